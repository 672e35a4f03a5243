#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "legopt/statistics/problem_scores.h"

namespace legopt::statistics {

/// A share of problems that grows in steps: an empirical distribution function, continuous from the right. Its last
/// share is below 1 if problems were not solved.
struct StepCurve {
  std::vector<double> at;     ///< positions of the steps, ascending, finite; unit of the values
  std::vector<double> share;  ///< share from each step on, in (0, 1], ascending; as long as `at`

  /// Returns the share of values <= x; 0 before the first step and without steps. Throws InputError for NaN.
  double At(double x) const;
  /// Returns the smallest x at which the share is reached, +infinity if it never is. Throws InputError unless `reached`
  /// lies in (0, 1].
  double FirstReaching(double reached) const;
};

/// Computes the share of all problems with values within x; unsolved problems have the value +infinity. For times in ms
/// this is the runtime distribution (More, Wild 2009, SIAM J. Optim. 20:172, data profile); for cost over best known
/// cost, "within 1 + eps of the best". Curves of different time limits are comparable up to the smaller limit, which
/// figures should mark. No values: no steps. Throws InputError for NaN and -infinity.
StepCurve Distribution(std::span<const double> values);

/// Computes the runtime distribution of runs with repetitions: the mean of the problems' own curves, so that every
/// problem has the same weight however often it ran. Failed runs never arrive. Missing runs, and problems with no other
/// runs, are ignored. Throws InputError for values of finished runs that are negative or not finite.
StepCurve RuntimeDistribution(std::span<const std::vector<Repetition>> problems);

/// Performance profile of a set of methods.
struct PerformanceProfile {
  std::vector<StepCurve> curves;  ///< rho(tau) over tau >= 1, per method
  int problems = 0;               ///< number of all problems, the denominator of the shares
  int unsolved = 0;               ///< number of problems solved by no method: counted in the shares, but without a
                                  ///< ratio
};

/// Computes the performance profile of Dolan and More (2002, Math. Program. 91:201): rho_s(tau) is the share of all
/// problems that method s solves within tau times the time of the best method on that problem. `rows[problem][method]`
/// holds times (ms) or costs, > 0, +infinity for a failure; ties for best have ratio 1 each. A profile shows only the
/// distance to the best method: removing one method may reverse the order of others (Gould, Scott 2016, ACM TOMS
/// 43(2):15), so compare two methods in a profile of the two. No rows: no curves. Throws InputError for values <= 0,
/// NaN and rows of unequal length.
PerformanceProfile ProfileOf(std::span<const std::vector<double>> rows);

/// Relation of two curves.
enum class Dominance : std::uint8_t {
  kEqual,
  kFirst,   ///< the first is nowhere below the second, and somewhere above
  kSecond,  ///< the second is nowhere below the first, and somewhere above
  kNone,    ///< the curves cross
};

/// Tests first-order dominance: has one method solved at least as many problems at every time? The curves must have the
/// same problems and limits. It describes this sample and is not a test.
Dominance Compare(const StepCurve& first, const StepCurve& second);

/// Returns the first x at which the curve that leads first is below the other one; +infinity if there is none (the
/// curves do not cross).
double FirstCrossing(const StepCurve& first, const StepCurve& second);

}  // namespace legopt::statistics

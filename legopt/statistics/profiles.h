#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "legopt/statistics/problem_scores.h"

namespace legopt::statistics {

/// A share of problems that grows in steps: an empirical distribution function, continuous from the right. It ends at
/// the share that ever arrives, which is below 1 where problems were not solved.
struct StepCurve {
  std::vector<double> at;     ///< where it steps, ascending, finite; unit of the values
  std::vector<double> share;  ///< from there on, in (0, 1], ascending; as many

  /// The share at x: of values <= x. 0 before the first step, and everywhere without steps. Throws InputError for NaN.
  double At(double x) const;
  /// The smallest x at which the share is reached, +infinity where it never is. For `reached` in (0, 1]. Throws
  /// InputError for others.
  double FirstReaching(double reached) const;
};

/// Share of all problems that are done within x: of their values, +infinity for those that never are. Of times in ms,
/// the runtime distribution (More, Wild 2009, SIAM J. Optim. 20:172, data profile); of cost over best known cost,
/// "within 1 + eps of the best". Curves of different time limits are comparable up to the smaller one, where a figure
/// should draw a line. No values: no steps. Throws InputError for NaN and -infinity.
StepCurve Distribution(std::span<const double> values);

/// The same of runs with repetitions: the mean of the problems' own curves, so that each problem weighs the same
/// however often it ran; failed runs never arrive, missing ones do not count, nor do problems that have no other.
/// Throws InputError for negative values and such as are not finite, of finished runs.
StepCurve RuntimeDistribution(std::span<const std::vector<Repetition>> problems);

/// Performance profile of a pool of methods.
struct PerformanceProfile {
  std::vector<StepCurve> curves;  ///< per method, rho(tau) over tau >= 1
  int problems = 0;               ///< that the shares are of: all
  int unsolved = 0;               ///< of them, solved by no method: in the shares, without a ratio
};

/// Performance profile of Dolan and More (2002, Math. Program. 91:201): rho_s(tau) is the share of all problems on
/// which method s takes at most tau times what the best method of the pool takes there. `rows[problem][method]` holds
/// times (ms) or costs, > 0, +infinity for a failure; ties for best have ratio 1 each. Only the distance to the best of
/// the pool can be read from it: leaving one method out may reverse the order of others (Gould, Scott 2016, ACM TOMS
/// 43(2):15), so that two methods want a profile of the two. No rows: no curves. Throws InputError for values <= 0, NaN
/// and rows of unequal length.
PerformanceProfile ProfileOf(std::span<const std::vector<double>> rows);

/// How two curves lie.
enum class Dominance : std::uint8_t {
  kEqual,   ///< the same
  kFirst,   ///< the first is nowhere below the other, and somewhere above
  kSecond,  ///< the second is
  kNone,    ///< they cross
};

/// First-order dominance: whether one method has solved at least as many at every time. Curves of the same problems and
/// limits; a description of this sample, not a test.
Dominance Compare(const StepCurve& first, const StepCurve& second);

/// Where the curve that leads first is first below the other one; +infinity where it never is (no dominance of the
/// other, no crossing).
double FirstCrossing(const StepCurve& first, const StepCurve& second);

}  // namespace legopt::statistics

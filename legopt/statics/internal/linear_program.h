#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "legopt/statics/internal/simplex_dictionary.h"

namespace legopt {

/// How the search of a linear program ended.
enum class LinearProgramStatus : std::uint8_t {
  kOptimal,     ///< x is optimal, and y proves it
  kInfeasible,  ///< no x satisfies the constraints, and y proves it
  kUnbounded,   ///< the objective has no lower bound
  kStalled      ///< the numbers are too ill-conditioned or not finite; no program of a stance is
};

/// Optimum of an objective that turns (LinearProgramSolver::Turn). Valid during the call.
struct TurnedOptimum {
  double angle = 0.0;
  const Eigen::VectorXd& x;            ///< n; carries the rounding of the pivots
  const Eigen::VectorXd& multipliers;  ///< m: of the objective
};

/// Returns a lower bound of the program's optimum with costs `c` from any multipliers y, without a solver:
///
///     y . b + sum_j min(0, c_j - y . A_j) upper_j - sum_i max(0, y_i) range_i
///
/// Columns and ranges without a bound count as bounded by `largest`, so that rounding does not spoil the proof.
double DualBound(const LinearProgram& program, const Eigen::VectorXd& c, const Eigen::VectorXd& y, double largest);

/// Dense primal simplex method for the constraints of a LinearProgram, of up to a few hundred columns, such as the
/// forces of a stance:
///
///     min c . x   s.t.  b - range <= A x <= b,  0 <= x <= upper
///
/// Phase 1 minimises the sum of the violations and steps past bounds while that decreases it. Dantzig's rule, and
/// Bland's after a series of pivots without progress. Variables and multipliers are computed again from the final
/// basis, so that they do not carry the rounding of the pivots; the status is decided with them. Deterministic: the
/// same calls give the same bits.
///
/// Contains workspaces: not thread-safe. Scale the program such that its numbers are of order 1: a value below
/// kFeasibilityTolerance counts as 0.
///
/// Source: Chvatal, Linear Programming, 1983, chapters 2, 3 and 8; phase 1: Maros, Computational Techniques of the
/// Simplex Method, 2003, chapter 9.
class LinearProgramSolver {
 public:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  /// Sum of infeasibilities up to which phase 1 counts as successful.
  static constexpr double kFeasibilityTolerance = 1e-9;

  /// Searches a point that satisfies the constraints. Returns kOptimal (x() is feasible), kInfeasible or kStalled.
  /// `program` must not change until the last Minimize or Turn.
  ///
  /// If infeasible, y = multipliers() has
  ///
  ///     y . b > sum over bounded columns of upper_j max(0, y . A_j) + sum over bounded ranges of range_i max(0, y_i)
  ///
  /// and, up to rounding, y . A_j <= 0 and y_i <= 0 for all others: no x can satisfy y . A x = y . (b - slacks).
  LinearProgramStatus Constrain(const LinearProgram& program);

  /// Like Constrain, but the search begins at the last basis, if the sizes are equal: a small part of the time if
  /// little has changed. The basis, and with it x(), depends on the programs before.
  LinearProgramStatus Resume(const LinearProgram& program);

  /// True after Constrain or Resume: Resume then has a basis to begin at.
  bool has_basis() const { return dictionary_.rows() > 0; }

  /// Minimises c . x from the present basis. Only after Constrain or Resume returned kOptimal. `c`: n.
  LinearProgramStatus Minimize(const Eigen::VectorXd& c);

  /// Follows the optimum of cos(a) c + sin(a) d while the angle a increases from 0 to 2 pi: the corners of the feasible
  /// set's projection to the plane (-c . x, -d . x), counter-clockwise. Calls `visit` at the first optimum, and then
  /// after each step to another one, with the objective for which both are optimal, until it returns false. Angles are
  /// inexact where an edge is short. Only after Minimize(c) returned kOptimal. Returns kOptimal or kStalled; x() and
  /// multipliers() remain those of Minimize.
  ///
  /// Source: parametric simplex method (Chvatal, as above, chapter 10).
  LinearProgramStatus Turn(const Eigen::VectorXd& c, const Eigen::VectorXd& d,
                           const std::function<bool(const TurnedOptimum&)>& visit);

  const Eigen::VectorXd& x() const { return x_; }            ///< n
  const Eigen::VectorXd& multipliers() const { return y_; }  ///< m: rate of the optimum per unit of b
  double objective() const { return objective_; }            ///< c . x
  int pivots() const { return pivots_; }                     ///< number of pivots of the last call

 private:
  enum class PivotRule : std::uint8_t {
    kDantzig,  ///< the column that improves the objective fastest, the largest pivot
    kBland     ///< the column or row whose variable has the smallest index
  };
  static PivotRule RuleAfter(int pivots_without_progress);

  LinearProgramStatus FindFeasible();
  /// Pivots until the sum of the violations is least; false: too many pivots, or none is large enough.
  bool ReduceViolations(double sum);
  /// Sets the objective to the sum of the violations and returns that sum.
  double SetViolationObjective();
  LinearProgramStatus IterateFeasible();
  /// Returns a column that improves the objective; -1: none does.
  Eigen::Index EnteringColumn(PivotRule rule) const;
  void FindBreakpoints(Eigen::Index column, double direction);
  SimplexStep ViolationStep(Eigen::Index column, double direction, PivotRule rule);
  SimplexStep FeasibleStep(Eigen::Index column, double direction, PivotRule rule) const;
  /// Turns the objectives until a column may enter, at most by a quarter; returns the angle.
  double TurnToNextColumn(PivotRule rule, Eigen::Index* column);
  /// Sets the costs of the columns; slacks have none.
  void SetCosts(const Eigen::VectorXd& c);
  /// Sets x, y and the objective from the basis and the original numbers.
  void Refine();

  /// A bound of a basic variable that a step reaches.
  struct Breakpoint {
    double length, rate;
    int row;
    bool to_upper;
  };

  SimplexDictionary dictionary_;
  std::vector<Breakpoint> breakpoints_;
  Eigen::VectorXd costs_;  ///< per variable of the dictionary
  Eigen::VectorXd x_, y_, turned_x_, turned_y_;
  double objective_ = 0.0;
  int pivots_ = 0;
};

}  // namespace legopt

#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

namespace legopt {

/// How the search of a linear program ended.
enum class LinearProgramStatus : std::uint8_t {
  kOptimal,     ///< x is optimal, and y proves it
  kInfeasible,  ///< no x satisfies the constraints, and y proves it
  kUnbounded,   ///< the objective has no lower bound
  kStalled      ///< too many pivots, which no program of a stance needs
};

/// Optimum of an objective that turns (LinearProgramSolver::Turn). Valid during the call.
struct TurnedOptimum {
  double angle = 0.0;
  const Eigen::VectorXd& x;  ///< n; carries the rounding of the pivots
  /// n: of the objective; that of a column without cost with a single entry, 1, is minus the multiplier of its row.
  const Eigen::VectorXd& reduced_costs;
};

/// Returns a lower bound of min c . x over the x >= 0 with A x = b, from any multipliers y, without a solver: the
/// optimum is at least y . b + sum_j x_j (c - A^T y)_j, of which each term is least at 0 or at the column's bound.
/// Columns without a bound count as bounded by `largest`, so that rounding does not spoil the proof.
double DualBound(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, const Eigen::VectorXd& upper,
                 const Eigen::VectorXd& c, const Eigen::VectorXd& y, double largest);

/// Dense primal simplex method with bounded variables:
///
///     min c . x   s.t.  A x = b,  0 <= x <= upper
///
/// for programs of up to a few hundred columns, such as the forces of a stance. Two phases; Dantzig's rule, and Bland's
/// after a series of pivots without progress. Basic variables and multipliers are computed again from the final basis,
/// so that they do not carry the rounding of the pivots. Deterministic: the same program gives the same bits.
///
/// Contains workspaces: not thread-safe. Scale the program such that its numbers are of order 1: a value below
/// kFeasibilityTolerance counts as 0.
///
/// Source: Chvatal, Linear Programming, 1983, chapters 3 and 8.
class LinearProgramSolver {
 public:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  /// Sum of infeasibilities up to which phase 1 counts as successful.
  static constexpr double kFeasibilityTolerance = 1e-9;

  /// Replaces the constraints and searches a feasible point. `A`: m x n; `b`: m; `upper`: n, > 0 or infinity. Returns
  /// kOptimal (x() is feasible), kInfeasible or kStalled.
  ///
  /// If infeasible, y = multipliers() has y . b > sum over bounded columns of upper_j max(0, y . A_j) and, up to
  /// rounding, y . A_j <= 0 for all other columns: no x can satisfy y . A x = y . b.
  LinearProgramStatus Constrain(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, const Eigen::VectorXd& upper);

  /// Replaces the constraints by others of the same size, for which the last basis may still be feasible: a small part
  /// of the time of Constrain. Returns false if it is not, or if there is none; then only Constrain may follow. The
  /// basis, and with it x(), depends on the programs before.
  bool Resume(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, const Eigen::VectorXd& upper);

  /// Minimises c . x from the present basis. Only after Constrain returned kOptimal or Resume true. `c`: n.
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
  /// Largest step of the entering column.
  struct Step {
    double length = 0.0;
    int row = -1;  ///< row whose basic variable reaches a bound; -1: the entering variable reaches its other one
    bool to_upper = false;
  };

  Eigen::Index rows() const { return b_.size(); }
  Eigen::Index columns() const { return upper_.size(); }
  void SetInitialBasis();
  /// Sets basis_matrix_ and its factors, and right_side_: b less the columns at their upper bounds.
  void FactorBasis();
  LinearProgramStatus Iterate(const Eigen::VectorXd& cost, double artificial_cost);
  void ComputeReducedCosts(const Eigen::VectorXd& cost, double artificial_cost, Eigen::VectorXd* reduced) const;
  Eigen::Index EnteringColumn(bool first_index) const;
  /// Turns reduced_ and turned_reduced_ until a column may enter, at most by a quarter; returns the angle.
  double TurnToNextColumn(Eigen::Index* column);
  void StoreBasicSolution(Eigen::VectorXd* x) const;
  Step LargestStep(Eigen::Index column, double direction) const;
  void Move(Eigen::Index column, double direction, const Step& step);
  void Pivot(Eigen::Index column, int row);
  void Refine(const Eigen::VectorXd& cost, double artificial_cost);
  double UpperOfBasic(Eigen::Index row) const;

  Eigen::MatrixXd A_;
  Eigen::VectorXd b_, upper_;
  Eigen::MatrixXd tableau_;  ///< inverse of the basis times A; only if has_tableau_
  bool has_tableau_ = false;
  Eigen::VectorXd values_;          ///< values of the basic variables
  Eigen::VectorXd reduced_;         ///< reduced costs
  Eigen::VectorXd turned_reduced_;  ///< derivative of reduced_ by the angle; empty outside of Turn
  Eigen::VectorXd turned_x_;        ///< basic solution during Turn
  Eigen::VectorXd sign_;            ///< sign of each row's artificial variable
  std::vector<int> basis_;          ///< per row: a column, or columns() + row of an artificial variable
  std::vector<char> in_basis_;      ///< per column
  std::vector<char> at_upper_;      ///< per column outside the basis
  double artificial_upper_ = 0.0;   ///< infinite in phase 1, 0 in phase 2
  Eigen::VectorXd x_, y_;
  Eigen::VectorXd no_cost_;
  Eigen::MatrixXd basis_matrix_;
  Eigen::VectorXd basis_cost_, right_side_, factors_of_rows_, pivot_row_;
  Eigen::PartialPivLU<Eigen::MatrixXd> factors_;
  double objective_ = 0.0;
  int pivots_ = 0;
};

}  // namespace legopt

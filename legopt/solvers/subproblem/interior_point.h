#pragma once

#include <cstddef>
#include <vector>

#include "legopt/solvers/subproblem/aligned_numbers.h"
#include "legopt/solvers/subproblem/convex_subproblem.h"
#include "legopt/solvers/subproblem/newton_matrix.h"
#include "legopt/solvers/subproblem/packed_rows.h"

namespace legopt {

/// Variables v in boxes [lower, upper] with the multipliers of both sides, for an interior-point method:
///
///     z_lower (v - lower) = z_upper (upper - v) = sigma,    z >= 0
///
/// Primal and dual variables of the solver's saddle point have this form. Given the Newton step d of v, the steps of
/// the multipliers are
///
///     dz_lower = e_lower - z_lower - z_lower d / (v - lower)
///     dz_upper = e_upper - z_upper + z_upper d / (upper - v)
///
/// with e = 0 for the affine step (sigma = 0). The corrected step uses r = d' / (v - lower) and q = d' / (upper - v) of
/// the affine step d':
///
///     e_lower = sigma / (v - lower) + z_lower r (1 + r)
///     e_upper = sigma / (upper - v) - z_upper q (1 - q).
///
/// Arrays have `size()` entries, a multiple of four. Fixed variables and padding have zero multipliers and steps and
/// never limit a step.
///
/// Plain data with the method's element-wise arithmetic, in whole vectors. One thread; allocates only while it grows.
class BoxedVariables {
 public:
  /// Fixes all variables at zero. `count` is rounded up to whole vectors.
  void Reset(size_t count);
  /// Lets variable i move between two finite bounds, `low` < `high`.
  void SetFree(size_t i, double low, double high);
  /// Fixes variable i at a value, in a box that limits nothing.
  void SetFixed(size_t i, double at);
  size_t size() const { return value.size(); }  ///< number of variables, rounded up to whole vectors

  /// Initialises the slacks v - lower and upper - v. Must be called when values and multipliers have been set. From
  /// then on, the slacks move along with v: computed as differences, they would round to zero near a bound long before
  /// convergence.
  void Start();
  double gap() const { return gap_; }  ///< sum of the complementarity products
  void UpdateGap();                    ///< recomputes gap() after multipliers were set directly
  /// Sets theta_i = z_lower / (v - lower) + z_upper / (upper - v).
  void BarrierHessian(AlignedDoubles& theta) const;
  /// Returns max(1, 1 / t), with t the longest part of the affine step that keeps all slacks and multipliers
  /// non-negative. `step` must be set.
  double InverseMaxAffineStep() const;
  /// Returns the gap after `length` times the affine step.
  double GapAfterAffine(double length) const;
  /// Computes e_lower and e_upper of the corrected step, and `drive`. `step` must still be the affine step.
  void Correct(double sigma);
  /// Computes the multipliers' part of the corrected step, which `step` must be now. Returns its max(1, 1 / t), as
  /// InverseMaxAffineStep() does.
  double CompleteDirection();
  /// Moves v, multipliers and slacks by `length` times their corrected steps. 0 <= length <= 1 / result of
  /// CompleteDirection().
  void Move(double length);

  AlignedDoubles value,  ///< v; set by the method between Reset() and Start(), as are the next four
      lower,             ///< lower bounds
      upper,             ///< upper bounds
      z_lower,           ///< multipliers of v >= lower, >= 0
      z_upper;           ///< multipliers of v <= upper, >= 0
  AlignedDoubles free;   ///< 1 for free variables, else 0
  AlignedDoubles step;   ///< step of `value`
  AlignedDoubles drive;  ///< e_lower - e_upper, added to the right-hand side of v's equation

 private:
  double gap_ = 0.0;
  AlignedDoubles below_, above_;                  // slacks
  AlignedDoubles inverse_below_, inverse_above_;  // inverse slacks; 0 for fixed variables
  AlignedDoubles z_lower_step_, z_upper_step_;    // e_lower and e_upper between Correct and CompleteDirection
};

/// Primal-dual interior-point method for ConvexSubproblem (Mehrotra's predictor-corrector).
///
/// The penalties are written as a saddle point, w|a| = max { y a : -w <= y <= w } and
/// w max(0, a) = max { y a : 0 <= y <= w }, so that both x and y lie in boxes:
///
///     min_{l <= x <= u} max_{ly <= y <= uy}  g^T x + 1/2 x^T H x + y^T (A x + b)
///
/// Stationarity, with z >= 0 the multipliers of x's box and w >= 0 those of y's:
///
///     H x + g + A^T y - zl + zu = 0            A x + b + wl - wu = 0
///     zl (x - l) = zu (u - x) = wl (y - ly) = wu (uy - y) = sigma -> 0
///
/// For any x and y, suitable z and w satisfy both equations from the start. Every iterate is therefore feasible, and
/// the sum of the products is the exact duality gap. A Newton step is one block-tridiagonal Cholesky factorisation of
/// H + Theta + A^T D A, so its cost is linear in the number of waypoints. The objective is divided by the largest
/// weight, which keeps penalties of 1e12 solvable.
///
/// While the gap is wide, steps are computed in single precision: the number of iterations is the same, and they take
/// two thirds of the time. The rounding errors of both equations are added to z and w before the gap is reported.
///
/// One thread; no allocation once the buffers have grown.
class InteriorPointSolver : public SubproblemSolver {
 public:
  Result Solve(const ConvexSubproblem& problem, const Accuracy& accuracy, Eigen::Ref<Eigen::VectorXd> dx) override;

 private:
  void Prepare(const ConvexSubproblem& problem);
  void FindFreeVariables(const ConvexSubproblem& problem);
  void SetBoxes(const ConvexSubproblem& problem);
  void CopySolution(const ConvexSubproblem& problem, Eigen::Ref<Eigen::VectorXd> dx) const;
  void StartingPoint();
  /// Sets row_values_ at x.
  void UpdateRows();
  /// Adds A^T y to `sum`.
  void AddTransposedRows(AlignedDoubles& sum) const;
  double Gap() const { return x_.gap() + y_.gap(); }
  void StartRow(size_t i, double a, double barrier);
  /// Returns m(0) - m(x), divided by scale_.
  double Decrease() const;
  bool IsSolved(const Accuracy& accuracy, double gap) const;
  /// Makes predictor, corrector and move. Returns the share of the direction that was taken; 0 if there was none.
  double Iterate(double gap);
  /// Factors the matrix and computes the predictor. In double precision, pivots are raised further until it is finite.
  bool AffineDirection();
  /// Factors the matrix and eliminates the predictor's right-hand side forward. Returns false if the factor is not
  /// finite.
  template <typename Real>
  bool Factor(NewtonMatrix<Real>& matrix, double pivot_floor);
  void SwitchToDoublePrecision();
  /// Computes Mehrotra's corrector for the target `sigma` of the products.
  bool CorrectedDirection(double sigma);
  /// Computes the steps of x and y from the right-hand side that has been eliminated forward. Returns false if they are
  /// not finite; the solver's variables do not change then.
  bool CompleteSteps();
  /// Moves all variables, and data derived from them, by a share of the direction.
  void Move(double length);

  int stride_ = 0, num_blocks_ = 0;
  int first_block_ = 0;  ///< first block of the problem with free variables
  size_t num_x_ = 0, num_y_ = 0, num_products_ = 0;
  double scale_ = 1.0;            ///< divisor of all values below that have the objective's unit
  double fixed_decrease_ = 0.0;   ///< m(0) minus m at the fixed variables' values
  bool shifted_ = false;          ///< some fixed variable is not 0
  bool single_precision_ = true;  ///< precision of the matrix
  bool double_matrix_begun_ = false;

  AlignedDoubles free_, fixed_;  ///< see PackedRows::Freedom
  PackedRows rows_;
  CostBlocks costs_;
  NewtonMatrix<float> single_matrix_;   ///< H + Theta + A'DA, and its factor
  NewtonMatrix<double> double_matrix_;  ///< used once single precision is exhausted
  BoxedVariables x_, y_;
  AlignedDoubles slope_;        ///< g + H x
  AlignedDoubles row_values_;   ///< A x + b
  AlignedDoubles row_steps_;    ///< A dx of the current direction
  AlignedDoubles theta_;        ///< barrier Hessian of x
  AlignedDoubles weight_;       ///< D, one entry per row: the inverse of y's barrier Hessian
  AlignedDoubles row_scratch_;  ///< one entry per row
};

}  // namespace legopt

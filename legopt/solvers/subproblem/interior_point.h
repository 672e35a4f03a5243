#pragma once

#include "legopt/solvers/subproblem/aligned_numbers.h"
#include "legopt/solvers/subproblem/boxed_variables.h"
#include "legopt/solvers/subproblem/convex_subproblem.h"
#include "legopt/solvers/subproblem/cost_blocks.h"
#include "legopt/solvers/subproblem/newton_matrix.h"
#include "legopt/solvers/subproblem/packed_rows.h"

namespace legopt {

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

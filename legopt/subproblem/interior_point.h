#pragma once

#include "legopt/subproblem/aligned_numbers.h"
#include "legopt/subproblem/boxed_variables.h"
#include "legopt/subproblem/convex_subproblem.h"
#include "legopt/subproblem/cost_blocks.h"
#include "legopt/subproblem/newton_matrix.h"
#include "legopt/subproblem/packed_rows.h"

namespace legopt {

/// Primal-dual interior-point method for ConvexSubproblem (Mehrotra's predictor-corrector).
///
/// The penalties are written as a saddle point, w|a| = max { y a : -w <= y <= w } and w max(0, a) = max { y a : 0 <= y
/// <= w }, so that both x and y live in boxes:
///
///     min_{l <= x <= u} max_{ly <= y <= uy}  g^T x + 1/2 x^T H x + y^T (A x + b)
///
/// Stationarity, with z >= 0 the multipliers of x's box and w >= 0 those of y's:
///
///     H x + g + A^T y - zl + zu = 0            A x + b + wl - wu = 0
///     zl (x - l) = zu (u - x) = wl (y - ly) = wu (uy - y) = sigma -> 0
///
/// Both equations hold from the start for suitable z and w, whatever x and y, so every iterate is feasible and the
/// sum of the products is the exact duality gap. A Newton step is one block-tridiagonal Cholesky factorisation of H +
/// Theta + A^T D A: linear cost in the number of waypoints. The objective is divided by the largest weight, which keeps
/// penalties of 1e12 solvable.
///
/// While the gap is wide, steps are computed in single precision: the iterations are as many, and take two thirds of
/// the time. What rounding leaves of both equations is taken into z and w before anything is said of the gap.
///
/// One thread; no allocation once the buffers have grown.
class InteriorPointSolver : public SubproblemSolver {
 public:
  Result Solve(const ConvexSubproblem& problem, const Accuracy& accuracy, Eigen::Ref<Eigen::VectorXd> dx) override;

 private:
  void Prepare(const ConvexSubproblem& problem);
  void FindFreedom(const ConvexSubproblem& problem);
  void SetBoxes(const ConvexSubproblem& problem);
  void TakeStep(const ConvexSubproblem& problem, Eigen::Ref<Eigen::VectorXd> dx) const;
  void StartingPoint();
  /// row_values_ at x.
  void UpdateRows();
  /// sum += A^T y.
  void AddTransposedRows(AlignedDoubles& sum) const;
  double Gap() const { return x_.gap() + y_.gap(); }
  void StartRow(size_t i, double a, double barrier);
  /// m(0) - m(x), divided by scale_.
  double Decrease() const;
  bool IsSolved(const Accuracy& accuracy, double gap) const;
  /// Predictor, corrector and move. Returns how much of the direction was taken: 0 when there was none.
  double Iterate(double gap);
  /// Factors the matrix and computes the predictor; in double precision, pivots are lifted further until it is finite.
  bool AffineDirection();
  /// The matrix's factor, and the predictor's right-hand side eliminated forward with it. False when it is not finite.
  template <typename Real>
  bool Factor(NewtonMatrix<Real>& matrix, double pivot_floor);
  void GoOnInDoublePrecision();
  /// Mehrotra's corrector for a target of the products.
  bool CorrectedDirection(double sigma);
  /// The steps of x and y from the right-hand side that has been eliminated forward. False when they are not finite;
  /// the solver's variables are unharmed then.
  bool CompleteSteps();
  /// All variables, and what is kept of them, by a part of the direction.
  void Move(double length);

  int stride_ = 0, num_blocks_ = 0;
  int first_block_ = 0;  ///< of the problem's, which has free variables, as has the last one
  size_t num_x_ = 0, num_y_ = 0, num_products_ = 0;
  double scale_ = 1.0;            ///< everything below is divided by it where it has the objective's unit
  double fixed_decrease_ = 0.0;   ///< m(0) less m where the fixed variables are
  bool shifted_ = false;          ///< some fixed variable is not at 0
  bool single_precision_ = true;  ///< of the matrix
  bool double_matrix_begun_ = false;

  AlignedDoubles free_, fixed_;  ///< PackedRows::Freedom
  PackedRows rows_;
  CostBlocks costs_;
  NewtonMatrix<float> single_matrix_;   ///< H + Theta + A'DA, and its factor
  NewtonMatrix<double> double_matrix_;  ///< likewise, once single precision has done what it can
  BoxedVariables x_, y_;
  AlignedDoubles slope_;        ///< g + H x
  AlignedDoubles row_values_;   ///< A x + b
  AlignedDoubles row_steps_;    ///< A dx of the direction at hand
  AlignedDoubles theta_;        ///< of x
  AlignedDoubles weight_;       ///< D by row, the inverse of y's theta
  AlignedDoubles row_scratch_;  ///< by row
};

}  // namespace legopt

#pragma once

#include <vector>

#include "legopt/subproblem/aligned_doubles.h"
#include "legopt/subproblem/block_chain.h"
#include "legopt/subproblem/boxed_variables.h"
#include "legopt/subproblem/convex_subproblem.h"
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
/// Both equations hold from the start for suitable z and w, whatever x and y, so every iterate is feasible and the sum
/// of the products is the exact duality gap. A Newton step is one block-tridiagonal Cholesky factorisation of H + Theta
/// + A^T D A: linear cost in the number of waypoints. The objective is divided by the largest weight, which keeps
/// penalties of 1e12 solvable.
///
/// One thread; no allocation once the buffers have grown.
class InteriorPointSolver : public SubproblemSolver {
 public:
  Result Solve(const ConvexSubproblem& problem, const Accuracy& accuracy, Eigen::Ref<Eigen::VectorXd> dx) override;

 private:
  void Prepare(const ConvexSubproblem& problem);
  void FindFreedom(const ConvexSubproblem& problem);
  void CopyCosts(const ConvexSubproblem& problem);
  void CopyHessian(const ConvexSubproblem& problem, int t);
  void CopyCoupling(const ConvexSubproblem& problem, int t);
  void ShiftByFixed(const ConvexSubproblem& problem);
  void SetBoxes(const ConvexSubproblem& problem);
  void TakeStep(const ConvexSubproblem& problem, Eigen::Ref<Eigen::VectorXd> dx) const;
  void StartingPoint();
  void StartRow(size_t i, double a, double barrier);
  /// slope_ at x.
  void UpdateSlope();
  /// m(0) - m(x), divided by scale_.
  double Decrease() const;
  bool IsSolved(const Accuracy& accuracy, double gap) const;
  /// Factors the matrix and computes the predictor; pivots are lifted further until it is finite.
  bool AffineDirection();
  /// The matrix's factor, and the predictor's right-hand side eliminated forward with it. False when it is not finite.
  bool Factor(double pivot_floor);
  void FormBlock(int t);
  /// Mehrotra's corrector for a target of the products.
  bool CorrectedDirection(double sigma);
  /// The steps of x and y from the right-hand side that has been eliminated forward. False when they are not finite;
  /// the solver's variables are unharmed then.
  bool CompleteSteps();
  /// All variables, and what is kept of them, by a part of the direction.
  void Move(double length);
  /// The problem's block t is its t + first_block_.
  double* Segment(AlignedDoubles& vector, int t) const {
    return vector.data() + static_cast<size_t>(t) * static_cast<size_t>(stride_);
  }

  /// A block of H or beside H's diagonal, divided by scale_: whole, or of a tiled one the tiles (dense_kernels.h).
  struct Square {
    bool tiled = false;
    size_t begin = 0;  ///< in squares_
  };
  double* Entries(const Square& square) { return squares_.data() + square.begin; }
  const double* Entries(const Square& square) const { return squares_.data() + square.begin; }
  Square NewSquare(bool tiled);

  int stride_ = 0, num_blocks_ = 0;
  int first_block_ = 0;  ///< of the problem's, which has free variables, as has the last one
  size_t num_x_ = 0, num_y_ = 0, num_products_ = 0;
  double scale_ = 1.0;           ///< everything below is divided by it where it has the objective's unit
  double fixed_decrease_ = 0.0;  ///< m(0) less m where the fixed variables are
  bool shifted_ = false;         ///< some fixed variable is not at 0
  bool chain_ = false;           ///< some coupling between blocks
  bool coupled_costs_ = false;

  AlignedDoubles free_, fixed_;  ///< PackedRows::Freedom
  PackedRows rows_;
  AlignedDoubles gradient_;
  AlignedDoubles squares_;
  std::vector<Square> hessian_, coupling_;  ///< whole diagonal blocks; (t, t + 1)
  BlockChain chain_matrix_;                 ///< H + Theta + A'DA, and its factor
  BoxedVariables x_, y_;
  AlignedDoubles slope_;        ///< g + H x
  AlignedDoubles row_values_;   ///< A x + b
  AlignedDoubles row_steps_;    ///< A dx of the direction at hand
  AlignedDoubles theta_;        ///< of x
  AlignedDoubles weight_;       ///< D by row, the inverse of y's theta
  AlignedDoubles row_scratch_;  ///< by row
};

}  // namespace legopt

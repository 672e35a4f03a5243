#pragma once

#include <vector>

#include "legopt/subproblem/block_chain.h"
#include "legopt/subproblem/boxed_variables.h"
#include "legopt/subproblem/convex_subproblem.h"

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
  /// Successive rows with the same blocks: a dense panel.
  struct RowGroup {
    size_t block;
    int num_blocks;
    size_t begin;  ///< first row
    int count;
    const double* coefficients;  ///< of the first row's first block; the next row lies num_blocks * stride further on
  };

  void Prepare(const ConvexSubproblem& problem);
  void GroupRows(const ConvexSubproblem& problem);
  void CopyHessian(const ConvexSubproblem& problem);
  void ChooseLinks();
  void StartingPoint(const ConvexSubproblem& problem);
  void StartRow(size_t i, double a, double barrier);
  void Residuals(const ConvexSubproblem& problem);
  /// m(0) - m(x) at the residuals' point, divided by scale_.
  double Decrease(const ConvexSubproblem& problem) const;
  bool IsSolved(const ConvexSubproblem& problem, const Accuracy& accuracy, double gap) const;
  /// Factors the matrix and computes the predictor; pivots are lifted further until it is finite.
  bool AffineDirection();
  bool Factor(double pivot_floor);
  void AddRows();
  void AddCoupling(const RowGroup& group, const double* scaled);
  /// False when it is not finite; the solver's variables are unharmed then.
  bool Direction(double sigma, bool corrector);
  double MaxStep() const;
  /// rhs += A^T c and product += A x.
  void AddTransposedRows(const std::vector<double>& c, std::vector<double>& rhs) const;
  void AddRowProducts(const std::vector<double>& x, std::vector<double>& product) const;
  double* Block(std::vector<double>& matrix, int t) const {
    return matrix.data() + static_cast<size_t>(t) * static_cast<size_t>(stride_) * static_cast<size_t>(stride_);
  }
  double* Segment(std::vector<double>& vector, int t) const {
    return vector.data() + static_cast<size_t>(t) * static_cast<size_t>(stride_);
  }

  size_t num_x_ = 0, num_y_ = 0, num_products_ = 0;
  int stride_ = 0, num_blocks_ = 0;
  double scale_ = 1.0;  ///< everything below is divided by it where it has the objective's unit
  bool chain_ = false;  ///< some coupling between blocks
  std::vector<RowGroup> groups_;

  std::vector<double> hessian_, hessian_coupling_;  ///< H, whole diagonal blocks
  std::vector<int> slim_rows_;                      ///< by block: rows of a slim coupling (BlockChain), or kDense
  std::vector<int> rows_so_far_;                    ///< by block, of those that were added
  BlockChain chain_matrix_;                         ///< H + Theta + A'DA, and its factor
  BoxedVariables x_, y_;
  std::vector<size_t> fixed_;        ///< indices of fixed variables, pad included
  std::vector<double> rd_, rp_;      ///< H x + g + A'y - zl + zu; A x + b + wl - wu
  std::vector<double> theta_;        ///< of x
  std::vector<double> weight_;       ///< D by row, the inverse of y's theta
  std::vector<double> rhs_;          ///< by variable
  std::vector<double> row_scratch_;  ///< by row
  std::vector<double> scaled_rows_;  ///< D A of one group
};

}  // namespace legopt

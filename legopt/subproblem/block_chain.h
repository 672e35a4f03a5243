#pragma once

#include <cstddef>
#include <vector>

#include "legopt/subproblem/aligned_doubles.h"
#include "legopt/subproblem/block_kernels.h"

namespace legopt {

/// A symmetric positive definite matrix of square blocks along the diagonal and beside it, and its Cholesky factor:
/// cost linear in the number of blocks.
///
/// What couples block t with its successor is C_t + sum_r l_r r_r^T. Where C_t is tiled (dense_kernels.h; costs of
/// steps between waypoints make it diagonal) and the rows are few, its Schur complement takes a third of the products
/// that a dense one takes. Blocks have `stride` rows, padded to whole vectors; pads are the identity's.
///
/// Block after block is written and eliminated, in this order and while it is in the cache.
///
/// One thread; no allocation once the buffers have grown.
class BlockChain {
 public:
  static constexpr int kMostRows =
      kernels::FactoredBlock::kMostRows;  ///< beside a tiled C: more cost what a dense does

  /// Begins matrices of a shape, one after the other. `chained`: with blocks beside the diagonal.
  void Reset(int num_blocks, int stride, bool chained);
  /// What couples block t < num_blocks - 1 of a chain from now on, until Reset. C_t, rows of block t and columns of
  /// block t + 1, stays the caller's and is read at every Eliminate(t): whole, or of a tiled one the tiles. Tiled: at
  /// most kMostRows `rows`.
  void SetCoupling(int t, const double* c, bool tiled, int rows);

  /// Row-major; the upper triangle counts. To be written before Eliminate(t).
  double* block(int t) { return At(matrix_, t); }
  double* left(int t, int row) { return Row(left_, t, row); }    ///< l, of block t. To be written before Eliminate(t).
  double* right(int t, int row) { return Row(right_, t, row); }  ///< r, of block t + 1. Likewise.

  /// Factors block t less what the elimination of block t - 1 takes from it. False when the factor is not finite.
  /// `pivot_floor`: of each diagonal entry, the least that elimination leaves.
  bool Eliminate(int t, double pivot_floor);
  /// b <- M^-1 b in two halves: for every t in order, SolveForward once block t is eliminated, and SolveBack at last.
  void SolveForward(int t, AlignedDoubles& b);
  void SolveBack(AlignedDoubles& b);  ///< the second half

 private:
  struct Link {
    const double* c = nullptr;
    bool tiled = false;
    int rows = 0;
    size_t first = 0;  ///< of its rows in left_ and right_
  };

  double* At(AlignedDoubles& blocks, int t) const {
    return blocks.data() + static_cast<size_t>(t) * static_cast<size_t>(stride_) * static_cast<size_t>(stride_);
  }
  double* Row(AlignedDoubles& rows, int t, int row) const {
    return rows.data() +
           (links_[static_cast<size_t>(t)].first + static_cast<size_t>(row)) * static_cast<size_t>(stride_);
  }
  bool linked(int t) const { return chained_ && t + 1 < num_blocks_; }
  int SquaresOfRows(int t);
  kernels::Reduction TakenFrom(int t);
  kernels::Coupling CouplingOf(int t);
  kernels::FactoredBlock Factored(int t);

  int num_blocks_ = 0, stride_ = 0;
  bool chained_ = false;
  std::vector<Link> links_;
  size_t num_rows_ = 0;
  AlignedDoubles matrix_;    ///< M, then U with M = U^T U
  AlignedDoubles coupling_;  ///< U^-T of C, and of the rows beside it where it is dense
  AlignedDoubles left_;      ///< l, then U^-T l beside a tiled C, -l of a dense one
  AlignedDoubles right_;
  AlignedDoubles min_pivot_;
  AlignedDoubles squares_left_, squares_right_;  ///< what rows beside C take from the next block, as products
};

}  // namespace legopt

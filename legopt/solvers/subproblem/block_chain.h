#pragma once

#include <cstddef>
#include <vector>

#include "legopt/solvers/subproblem/aligned_numbers.h"
#include "legopt/solvers/subproblem/block_kernels.h"

namespace legopt {

/// A symmetric positive definite, block-tridiagonal matrix of square blocks, and its Cholesky factor. The cost is
/// linear in the number of blocks.
///
/// The coupling of block t with its successor is C_t + sum_r l_r r_r^T. If C_t is tiled (dense_kernels.h; costs of
/// steps between waypoints make it diagonal) and the rows are few, its Schur complement takes a third of the
/// products of a dense one. Blocks have `stride` rows, padded to whole vectors. The padding is that of the identity; in
/// C, l and r it is zero.
///
/// Blocks are written and eliminated one after the other, in this order and while they are in the cache. Eliminate(t)
/// overwrites block t, so all of it must be written again for the next matrix.
///
/// `Real` is double or float. One thread; no allocation once the buffers have grown.
template <typename Real>
class BlockChain {
 public:
  /// Prepares for a sequence of matrices of one shape. If `chained`, blocks are coupled, and SetCoupling must be
  /// called for each coupling.
  void Reset(int num_blocks, int stride, bool chained);
  /// Sets the coupling of block t < num_blocks - 1 with the next one, until Reset: C_t tiled or dense, and the
  /// number of rows l and r beside it (if tiled, at most kernels::kMaxExtraRows). Invalidates pointers returned by
  /// left() and right().
  void SetCoupling(int t, bool tiled, int rows);

  Real* block(int t) { return At(matrix_, t); }                ///< row-major; only the upper triangle is used
  Real* left(int t, int row) { return Row(left_, t, row); }    ///< row l of block t
  Real* right(int t, int row) { return Row(right_, t, row); }  ///< row r of block t + 1

  /// Factors block t after subtracting the contribution of block t - 1. Returns false if the factor is not finite. `c`:
  /// C_t, rows of block t and columns of block t + 1, whole or, if tiled, only the tiles. It is not read for the last
  /// block or without a chain. `pivot_floor`: lower limit of pivots, relative to the diagonal entries.
  bool Eliminate(int t, const Real* c, Real pivot_floor);
  /// b <- M^-1 b in two halves: call SolveForward for every t in order, once block t is eliminated, then SolveBack.
  void SolveForward(int t, AlignedNumbers<Real>& b);
  void SolveBack(AlignedNumbers<Real>& b);  ///< second half

 private:
  struct Link {
    bool tiled = false;
    int rows = 0;
    size_t first = 0;  ///< index of its first row in left_ and right_
  };

  Real* At(AlignedNumbers<Real>& blocks, int t) const {
    return blocks.data() + static_cast<size_t>(t) * static_cast<size_t>(stride_) * static_cast<size_t>(stride_);
  }
  Real* Row(AlignedNumbers<Real>& rows, int t, int row) const {
    return rows.data() +
           (links_[static_cast<size_t>(t)].first + static_cast<size_t>(row)) * static_cast<size_t>(stride_);
  }
  bool linked(int t) const { return chained_ && t + 1 < num_blocks_; }
  void SetMinPivots(int t, Real pivot_floor);
  void NegateLeft(int t);
  int SquaresOfRows(int t);
  kernels::Reduction<Real> ReductionOf(int t);
  kernels::Coupling<Real> CouplingOf(int t, const Real* c);
  kernels::FactoredBlock<Real> Factored(int t);

  int num_blocks_ = 0, stride_ = 0;
  bool chained_ = false;
  std::vector<Link> links_;
  size_t num_rows_ = 0;
  AlignedNumbers<Real> matrix_;   ///< M, then U with M = U^T U
  AlignedNumbers<Real> coupled_;  ///< T: U^-T of C, including the rows beside C if C is dense
  AlignedNumbers<Real> left_;     ///< l, then U^-T l if C is tiled, -l if it is dense
  AlignedNumbers<Real> right_;
  AlignedNumbers<Real> min_pivot_;
  AlignedNumbers<Real> squares_left_, squares_right_;  ///< products by which rows beside C reduce the next block
};

}  // namespace legopt

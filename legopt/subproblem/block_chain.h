#pragma once

#include <cstddef>
#include <vector>

#include "legopt/subproblem/aligned_numbers.h"
#include "legopt/subproblem/block_kernels.h"

namespace legopt {

/// A symmetric positive definite matrix of square blocks along the diagonal and beside it, and its Cholesky factor:
/// cost linear in the number of blocks.
///
/// What couples block t with its successor is C_t + sum_r l_r r_r^T. Where C_t is tiled (dense_kernels.h; costs of
/// steps between waypoints make it diagonal) and the rows are few, its Schur complement takes a third of the products
/// that a dense one takes. Blocks have `stride` rows, padded to whole vectors; pads are the identity's, those of C, l
/// and r zero.
///
/// Block after block is written and eliminated, in this order and while it is in the cache. Eliminate(t) takes the
/// place of what was written for t: each time all of it is written anew.
///
/// `Real` is double or float. One thread; no allocation once the buffers have grown.
template <typename Real>
class BlockChain {
 public:
  /// Begins matrices of a shape, one after the other. `chained`: with blocks beside the diagonal, each of which
  /// SetCoupling must tell of.
  void Reset(int num_blocks, int stride, bool chained);
  /// What couples block t < num_blocks - 1 of a chain from now on, until Reset: C_t tiled or dense, and the number of
  /// rows l and r beside it, of a tiled one at most kernels::kMostRowsBeside. Ends what left() and right() have
  /// returned.
  void SetCoupling(int t, bool tiled, int rows);

  Real* block(int t) { return At(matrix_, t); }                ///< row-major; the upper triangle counts
  Real* left(int t, int row) { return Row(left_, t, row); }    ///< l, of block t
  Real* right(int t, int row) { return Row(right_, t, row); }  ///< r, of block t + 1

  /// Factors block t less what the elimination of block t - 1 takes from it. False when the factor is not finite.
  /// `c`: C_t, rows of block t and columns of block t + 1: whole, or of a tiled one the tiles; of the last block, and
  /// without a chain, not read. `pivot_floor`: of each diagonal entry, the least that elimination leaves.
  bool Eliminate(int t, const Real* c, Real pivot_floor);
  /// b <- M^-1 b in two halves: for every t in order, SolveForward once block t is eliminated, and SolveBack at last.
  void SolveForward(int t, AlignedNumbers<Real>& b);
  void SolveBack(AlignedNumbers<Real>& b);  ///< the second half

 private:
  struct Link {
    bool tiled = false;
    int rows = 0;
    size_t first = 0;  ///< of its rows in left_ and right_
  };

  Real* At(AlignedNumbers<Real>& blocks, int t) const {
    return blocks.data() + static_cast<size_t>(t) * static_cast<size_t>(stride_) * static_cast<size_t>(stride_);
  }
  Real* Row(AlignedNumbers<Real>& rows, int t, int row) const {
    return rows.data() +
           (links_[static_cast<size_t>(t)].first + static_cast<size_t>(row)) * static_cast<size_t>(stride_);
  }
  bool linked(int t) const { return chained_ && t + 1 < num_blocks_; }
  void KeepPivots(int t, Real pivot_floor);
  void NegateLeft(int t);
  int SquaresOfRows(int t);
  kernels::Reduction<Real> TakenFrom(int t);
  kernels::Coupling<Real> CouplingOf(int t, const Real* c);
  kernels::FactoredBlock<Real> Factored(int t);

  int num_blocks_ = 0, stride_ = 0;
  bool chained_ = false;
  std::vector<Link> links_;
  size_t num_rows_ = 0;
  AlignedNumbers<Real> matrix_;   ///< M, then U with M = U^T U
  AlignedNumbers<Real> coupled_;  ///< T: U^-T of C, and of the rows beside it where it is dense
  AlignedNumbers<Real> left_;     ///< l, then U^-T l beside a tiled C, -l beside a dense one
  AlignedNumbers<Real> right_;
  AlignedNumbers<Real> min_pivot_;
  AlignedNumbers<Real> squares_left_, squares_right_;  ///< what rows beside C take from the next block, as products
};

}  // namespace legopt

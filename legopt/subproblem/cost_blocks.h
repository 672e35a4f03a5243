#pragma once

#include <span>
#include <vector>

#include "legopt/subproblem/aligned_numbers.h"
#include "legopt/subproblem/convex_subproblem.h"
#include "legopt/subproblem/packed_rows.h"

namespace legopt {

/// g^T x + 1/2 x^T H x of a subproblem over its free variables, divided by a scale: H's blocks along the diagonal and
/// beside it, each of them whole or, where it has nothing else, the 4 x 4 tiles along its own diagonal
/// (dense_kernels.h). Rows and columns of fixed variables are zero but for ones on the diagonal; what they add to g
/// is in it.
///
/// Vectors have a segment of `stride` entries for each block. One thread; allocates only while it grows.
class CostBlocks {
 public:
  /// A block of H or beside H's diagonal.
  struct Square {
    bool tiled = false;  ///< the tiles alone
    size_t begin = 0;    ///< in entries(): `stride` rows, whole or of four
  };

  /// Blocks are counted from `freedom.first_block` on. `rows`: of the same blocks; they stand beside tiled couplings.
  void Copy(const ConvexSubproblem& problem, const PackedRows::Freedom& freedom, const PackedRows& rows, double scale);

  int num_blocks() const { return num_blocks_; }  ///< along the diagonal
  int stride() const { return stride_; }          ///< rows of a block, with the pad
  /// Whether something, of the costs or of the rows, couples blocks.
  bool chained() const { return chained_; }
  const AlignedDoubles& gradient() const { return gradient_; }                         ///< g
  std::span<const double> entries() const { return {entries_.data(), num_entries_}; }  ///< of all squares
  /// Symmetric; of a whole one the upper triangle is there, and the diagonal's tiles.
  const Square& hessian(int t) const { return hessian_[static_cast<size_t>(t)]; }
  /// Rows of block t, columns of block t + 1; `chained`.
  const Square& coupling(int t) const { return coupling_[static_cast<size_t>(t)]; }
  /// slope = g + H x.
  void Slope(const AlignedDoubles& x, AlignedDoubles& slope) const;

 private:
  Square NewSquare(bool tiled);
  double* Entries(const Square& square) { return entries_.data() + square.begin; }
  const double* Entries(const Square& square) const { return entries_.data() + square.begin; }
  void CopyHessian(const ConvexSubproblem& problem, const PackedRows::Freedom& freedom, int t);
  void CopyCoupling(const ConvexSubproblem& problem, const PackedRows::Freedom& freedom, bool tiled, int t);
  void ShiftByFixed(const ConvexSubproblem& problem, const PackedRows::Freedom& freedom);

  int num_blocks_ = 0, stride_ = 0;
  double scale_ = 1.0;
  bool chained_ = false;
  bool coupled_ = false;  ///< by costs
  AlignedDoubles gradient_, entries_;
  size_t num_entries_ = 0;  ///< of those that are in use
  std::vector<Square> hessian_, coupling_;
};

}  // namespace legopt

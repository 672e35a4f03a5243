#pragma once

#include <span>
#include <vector>

#include "legopt/solvers/subproblem/aligned_numbers.h"
#include "legopt/solvers/subproblem/block_chain.h"
#include "legopt/solvers/subproblem/convex_subproblem.h"
#include "legopt/solvers/subproblem/packed_rows.h"

namespace legopt {

/// g^T x + 1/2 x^T H x of a subproblem over its free variables, divided by a scale. It has H's diagonal and
/// off-diagonal blocks, each of them whole or, if the rest is zero, as the 4 x 4 tiles along its own diagonal
/// (dense_kernels.h). Rows and columns of fixed variables are zero, with ones on the diagonal; g includes their
/// contribution.
///
/// Vectors have a segment of `stride` entries for each block. One thread; allocates only while it grows.
class CostBlocks {
 public:
  /// A diagonal or off-diagonal block of H.
  struct Square {
    bool tiled = false;  ///< stored as tiles only
    size_t begin = 0;    ///< start in entries(): `stride` rows, whole or of four entries
  };

  /// Copies the costs; block 0 is `freedom.first_block`. `rows` are rows of the same blocks, stored beside tiled
  /// couplings.
  void Copy(const ConvexSubproblem& problem, const PackedRows::FreeVariables& freedom, const PackedRows& rows,
            double scale);

  int num_blocks() const { return num_blocks_; }  ///< number of diagonal blocks
  int stride() const { return stride_; }          ///< number of rows of a block, with padding
  /// Returns whether costs or rows couple blocks.
  bool chained() const { return chained_; }
  const AlignedDoubles& gradient() const { return gradient_; }                         ///< g
  std::span<const double> entries() const { return {entries_.data(), num_entries_}; }  ///< entries of all squares
  /// Returns diagonal block t, symmetric; if whole, only its upper triangle and the diagonal's tiles are set.
  const Square& hessian(int t) const { return hessian_[static_cast<size_t>(t)]; }
  /// Returns the coupling, with rows of block t and columns of block t + 1; requires `chained`.
  const Square& coupling(int t) const { return coupling_[static_cast<size_t>(t)]; }
  /// Sets slope = g + H x.
  void Slope(const AlignedDoubles& x, AlignedDoubles& slope) const;

 private:
  Square NewSquare(bool tiled);
  double* Entries(const Square& square) { return entries_.data() + square.begin; }
  const double* Entries(const Square& square) const { return entries_.data() + square.begin; }
  void CopyHessian(const ConvexSubproblem& problem, const PackedRows::FreeVariables& freedom, int t);
  void CopyCoupling(const ConvexSubproblem& problem, const PackedRows::FreeVariables& freedom, bool tiled, int t);
  void ShiftByFixed(const ConvexSubproblem& problem, const PackedRows::FreeVariables& freedom);

  int num_blocks_ = 0, stride_ = 0;
  double scale_ = 1.0;
  bool chained_ = false;
  bool coupled_ = false;  ///< costs couple blocks
  AlignedDoubles gradient_, entries_;
  size_t num_entries_ = 0;  ///< number of entries in use
  std::vector<Square> hessian_, coupling_;
};

/// M = H + Theta + A^T D A, the matrix of the interior-point method's Newton steps, and its products with A. All are
/// computed in the precision `Real`, double or float; inputs and outputs are doubles.
///
/// One thread; no allocation once the buffers have grown.
template <typename Real>
class NewtonMatrix {
 public:
  /// Sets H and A of a problem. Both are read until the next Reset and must not change.
  void Reset(const CostBlocks& costs, const PackedRows& rows);
  /// Starts a matrix of the problem. `d`: diagonal of D, one entry per row; read until the next call.
  void SetWeights(const AlignedDoubles& d) { weights_.Set(d); }
  /// Forms and factors block t; call it for every t in order. `theta`: diagonal of Theta, one entry per variable.
  /// `pivot_floor`: lower limit of pivots, relative to the diagonal entries. Returns false if the factor is not finite.
  bool Eliminate(int t, const AlignedDoubles& theta, double pivot_floor);

  // M dx = b + A^T c: BeginSolve; for every t in order, SolveForward once block t is eliminated; SolveBack.

  /// Sets the right-hand side. `c`: one entry per row; read until the next call.
  void BeginSolve(const AlignedDoubles& b, const AlignedDoubles& c);
  void SolveForward(int t);  ///< first half, block t
  /// Overwrites dx, and the entries of `row_products` that belong to rows with A dx.
  void SolveBack(AlignedDoubles& dx, AlignedDoubles& row_products);

 private:
  void FormBlock(int t, const AlignedDoubles& theta);

  const CostBlocks* costs_ = nullptr;
  const PackedRows* rows_ = nullptr;
  RoundedNumbers<Real> squares_, coefficients_, weights_, multipliers_;
  BlockChain<Real> chain_;
  AlignedNumbers<Real> right_;     ///< b + A^T c, then dx
  AlignedNumbers<Real> products_;  ///< A dx
  AlignedNumbers<Real> scratch_;   ///< scratch of the kernels
};

}  // namespace legopt

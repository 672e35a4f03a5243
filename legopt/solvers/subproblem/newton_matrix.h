#pragma once

#include "legopt/solvers/subproblem/aligned_numbers.h"
#include "legopt/solvers/subproblem/block_chain.h"
#include "legopt/solvers/subproblem/cost_blocks.h"
#include "legopt/solvers/subproblem/packed_rows.h"
#include "legopt/solvers/subproblem/rounded_numbers.h"

namespace legopt {

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

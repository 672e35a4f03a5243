#pragma once

#include "legopt/subproblem/aligned_numbers.h"
#include "legopt/subproblem/block_chain.h"
#include "legopt/subproblem/cost_blocks.h"
#include "legopt/subproblem/packed_rows.h"
#include "legopt/subproblem/rounded_numbers.h"

namespace legopt {

/// M = H + Theta + A^T D A, the matrix of the interior-point method's Newton steps, and its products with A: all of
/// it in a precision, `Real`, double or float, while what goes in and comes out is in doubles.
///
/// One thread; no allocation once the buffers have grown.
template <typename Real>
class NewtonMatrix {
 public:
  /// Begins a problem: H and A. Both are read until the next one, and must stay as they are.
  void Reset(const CostBlocks& costs, const PackedRows& rows);
  /// Begins a matrix of the problem. `d`: by row, D's diagonal; read until the next one.
  void SetWeights(const AlignedDoubles& d) { weights_.Set(d); }
  /// Forms and factors block t, for every t in order. `theta`: by variable, Theta's diagonal. `pivot_floor`: of each
  /// diagonal entry, the least that elimination leaves. False when the factor is not finite.
  bool Eliminate(int t, const AlignedDoubles& theta, double pivot_floor);

  // M dx = b + A^T c: Begin; for every t in order, SolveForward once block t is eliminated; SolveBack.

  /// `c`: by row; read until the next one.
  void BeginSolve(const AlignedDoubles& b, const AlignedDoubles& c);
  void SolveForward(int t);  ///< the first half, of block t
  /// Overwrites dx, and with A dx the entries of `row_products` that are rows.
  void SolveBack(AlignedDoubles& dx, AlignedDoubles& row_products);

 private:
  void FormBlock(int t, const AlignedDoubles& theta);

  const CostBlocks* costs_ = nullptr;
  const PackedRows* rows_ = nullptr;
  RoundedNumbers<Real> squares_, coefficients_, weights_, multipliers_;
  BlockChain<Real> chain_;
  AlignedNumbers<Real> right_;     ///< b + A^T c, then dx
  AlignedNumbers<Real> products_;  ///< A dx
  AlignedNumbers<Real> scratch_;   ///< of the kernels
};

}  // namespace legopt

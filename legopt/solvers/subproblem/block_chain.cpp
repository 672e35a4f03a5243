#include "legopt/solvers/subproblem/block_chain.h"

#include <algorithm>

#include "legopt/solvers/subproblem/block_kernels.h"
#include "legopt/solvers/subproblem/dense_kernels.h"
#include "legopt/types/invariant.h"

namespace legopt {
namespace {

template <typename Real>
constexpr Real kLeastPivot = 1e-200;
template <>
constexpr float kLeastPivot<float> = 1e-30F;

}  // namespace

template <typename Real>
void BlockChain<Real>::Reset(int num_blocks, int stride, bool chained) {
  num_blocks_ = num_blocks;
  stride_ = stride;
  chained_ = chained;
  num_rows_ = 0;
  links_.assign(static_cast<size_t>(num_blocks), {});
  const size_t size = static_cast<size_t>(num_blocks) * static_cast<size_t>(stride);
  matrix_.resize(size * static_cast<size_t>(stride));
  if (chained) coupled_.resize(size * static_cast<size_t>(stride));
  min_pivot_.resize(static_cast<size_t>(stride));
  squares_left_.resize(size_t{2} * kernels::kMaxExtraRows * static_cast<size_t>(stride));
  squares_right_.resize(squares_left_.size());
}

template <typename Real>
void BlockChain<Real>::SetCoupling(int t, bool tiled, int rows) {
  CheckInvariant(linked(t), "a block is coupled with the next one", t, num_blocks_);
  CheckInvariant(!tiled || rows <= kernels::kMaxExtraRows, "a tiled coupling has few rows", rows);
  links_[static_cast<size_t>(t)] = {tiled, rows, num_rows_};
  num_rows_ += static_cast<size_t>(rows);
  const size_t entries = num_rows_ * static_cast<size_t>(stride_);
  left_.resize(std::max(left_.size(), entries));
  right_.resize(std::max(right_.size(), entries));
  // Entries right of the diagonal's tiles are never written, but whole vectors of them are read.
  if (tiled) std::fill_n(At(coupled_, t), static_cast<std::ptrdiff_t>(stride_) * stride_, Real{0});
}

// With T = U^-T C, z = U^-T l: (T + sum z r^T)^T (T + sum z r^T) = T^T T + sum (q r^T + r q^T) for
// q_a = T^T z_a + 1/2 sum_b (z_a . z_b) r_b. Returns the number of products, q with r and r with q.
template <typename Real>
int BlockChain<Real>::SquaresOfRows(int t) {
  const int rows = links_[static_cast<size_t>(t)].rows;
  for (int a = 0; a < rows; ++a) {
    Real* const q = squares_left_.data() + static_cast<std::ptrdiff_t>(a) * stride_;
    std::fill_n(q, stride_, Real{0});
    kernels::AddCombinationOfLower(left(t, a), At(coupled_, t), q, stride_);
    for (int b = 0; b < rows; ++b) {
      kernels::Axpy(Real{0.5} * kernels::Dot(left(t, a), left(t, b), stride_), right(t, b), q, stride_);
    }
    std::copy_n(q, stride_, squares_right_.data() + static_cast<std::ptrdiff_t>(rows + a) * stride_);
    std::copy_n(right(t, a), stride_, squares_right_.data() + static_cast<std::ptrdiff_t>(a) * stride_);
    std::copy_n(right(t, a), stride_, squares_left_.data() + static_cast<std::ptrdiff_t>(rows + a) * stride_);
  }
  return 2 * rows;
}

template <typename Real>
bool BlockChain<Real>::Eliminate(int t, const Real* c, Real pivot_floor) {
  const Link& link = links_[static_cast<size_t>(t)];
  Real* const m = block(t);
  SetMinPivots(t, pivot_floor);
  if (!link.tiled) NegateLeft(t);
  if (!kernels::ChosenKernels<Real>().factor(ReductionOf(t), m, min_pivot_.data(), CouplingOf(t, c), stride_))
    return false;
  for (int r = 0; link.tiled && r < link.rows; ++r) kernels::SolveTransposed(m, stride_, left(t, r));
  return true;
}

template <typename Real>
void BlockChain<Real>::SetMinPivots(int t, Real pivot_floor) {
  const Real* const m = block(t);
  const std::ptrdiff_t diagonal = stride_ + 1;
  for (int i = 0; i < stride_; ++i) {
    min_pivot_[static_cast<size_t>(i)] = std::max(pivot_floor * m[i * diagonal], kLeastPivot<Real>);
  }
}

template <typename Real>
void BlockChain<Real>::NegateLeft(int t) {
  const int entries = links_[static_cast<size_t>(t)].rows * stride_;
  Real* const rows = left(t, 0);
  for (int i = 0; i < entries; ++i) rows[i] = -rows[i];
}

/// Returns the part that the elimination of block t - 1 subtracts from block t.
template <typename Real>
kernels::Reduction<Real> BlockChain<Real>::ReductionOf(int t) {
  kernels::Reduction<Real> taken;
  if (t == 0 || !linked(t - 1)) return taken;
  taken.t = At(coupled_, t - 1);
  taken.lower = links_[static_cast<size_t>(t - 1)].tiled;
  if (!taken.lower) return taken;
  taken.count = SquaresOfRows(t - 1);
  taken.a = squares_left_.data();
  taken.b = squares_right_.data();
  return taken;
}

template <typename Real>
kernels::Coupling<Real> BlockChain<Real>::CouplingOf(int t, const Real* c) {
  kernels::Coupling<Real> coupling;
  if (!linked(t)) return coupling;
  const Link& link = links_[static_cast<size_t>(t)];
  coupling.c = c;
  coupling.tiled = link.tiled;
  coupling.t = At(coupled_, t);
  if (link.tiled) return coupling;
  coupling.minus_left = left(t, 0);
  coupling.right = right(t, 0);
  coupling.count = link.rows;
  return coupling;
}

template <typename Real>
kernels::FactoredBlock<Real> BlockChain<Real>::Factored(int t) {
  kernels::FactoredBlock<Real> factored;
  factored.u = block(t);
  factored.stride = stride_;
  if (!linked(t)) return factored;
  const Link& link = links_[static_cast<size_t>(t)];
  factored.t = At(coupled_, t);
  factored.lower = link.tiled;
  if (!link.tiled) return factored;
  factored.left = left(t, 0);
  factored.right = right(t, 0);
  factored.count = link.rows;
  return factored;
}

template <typename Real>
void BlockChain<Real>::SolveForward(int t, AlignedNumbers<Real>& b) {
  kernels::SolveForward(Factored(t), b.data() + static_cast<std::ptrdiff_t>(t) * stride_);
}

template <typename Real>
void BlockChain<Real>::SolveBack(AlignedNumbers<Real>& b) {
  for (int t = num_blocks_ - 1; t >= 0; --t) {
    kernels::SolveBack(Factored(t), b.data() + static_cast<std::ptrdiff_t>(t) * stride_);
  }
}

template class BlockChain<double>;
template class BlockChain<float>;

}  // namespace legopt

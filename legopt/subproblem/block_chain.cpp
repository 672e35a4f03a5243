#include "legopt/subproblem/block_chain.h"

#include <algorithm>

#include "legopt/subproblem/block_kernels.h"
#include "legopt/subproblem/dense_kernels.h"

namespace legopt {
namespace {

constexpr double kLeastPivot = 1e-200;

}  // namespace

void BlockChain::Reset(int num_blocks, int stride, bool chained) {
  num_blocks_ = num_blocks;
  stride_ = stride;
  chained_ = chained;
  num_rows_ = 0;
  links_.assign(static_cast<size_t>(num_blocks), {});
  const size_t size = static_cast<size_t>(num_blocks) * static_cast<size_t>(stride);
  matrix_.resize(size * static_cast<size_t>(stride));
  if (chained) coupling_.resize(size * static_cast<size_t>(stride));
  min_pivot_.resize(static_cast<size_t>(stride));
  scratch_.resize(static_cast<size_t>(stride));
  squares_left_.resize(size_t{2} * kMostRows * static_cast<size_t>(stride));
  squares_right_.resize(squares_left_.size());
}

void BlockChain::SetSlim(int t, int rows) {
  links_[static_cast<size_t>(t)] = {true, rows, num_rows_};
  num_rows_ += static_cast<size_t>(rows);
  const size_t entries = num_rows_ * static_cast<size_t>(stride_);
  left_.resize(std::max(left_.size(), entries));
  right_.resize(std::max(right_.size(), entries));
}

// With T = U^-T C, z = U^-T l: (T + sum z r^T)^T (T + sum z r^T) = T^T T + sum (q r^T + r q^T) for
// q_a = T^T z_a + 1/2 sum_b (z_a . z_b) r_b. The number of products, q beside r and r beside q.
int BlockChain::SquaresOfRows(int t) {
  const int rows = links_[static_cast<size_t>(t)].rows;
  for (int a = 0; a < rows; ++a) {
    double* const q = squares_left_.data() + static_cast<std::ptrdiff_t>(a) * stride_;
    std::fill_n(q, stride_, 0.0);
    kernels::AddCombinationOfLower(left(t, a), coupling(t), q, stride_);
    for (int b = 0; b < rows; ++b) {
      kernels::Axpy(0.5 * kernels::Dot(left(t, a), left(t, b), stride_), right(t, b), q, stride_);
    }
    std::copy_n(q, stride_, squares_right_.data() + static_cast<std::ptrdiff_t>(rows + a) * stride_);
    std::copy_n(right(t, a), stride_, squares_right_.data() + static_cast<std::ptrdiff_t>(a) * stride_);
    std::copy_n(right(t, a), stride_, squares_left_.data() + static_cast<std::ptrdiff_t>(rows + a) * stride_);
  }
  return 2 * rows;
}

bool BlockChain::Eliminate(int t, double pivot_floor) {
  double* const m = block(t);
  const std::ptrdiff_t diagonal = stride_ + 1;
  for (int i = 0; i < stride_; ++i) {
    min_pivot_[static_cast<size_t>(i)] = std::max(pivot_floor * m[i * diagonal], kLeastPivot);
  }
  kernels::Reduction before;
  if (chained_ && t > 0) {
    before = {coupling(t - 1), slim(t - 1), squares_left_.data(), squares_right_.data(), 0};
    if (slim(t - 1)) before.count = SquaresOfRows(t - 1);
  }
  const bool links = chained_ && t + 1 < num_blocks_;
  double* const coupled = links ? coupling(t) : nullptr;
  if (!kernels::ChosenKernels().factor(before, m, min_pivot_.data(), coupled, slim(t), stride_)) return false;
  for (int r = 0; r < links_[static_cast<size_t>(t)].rows; ++r) kernels::SolveTransposed(m, stride_, left(t, r));
  return true;
}

void BlockChain::SolveForward(int t, AlignedDoubles& b) {
  double* part = b.data() + static_cast<std::ptrdiff_t>(t) * stride_;
  kernels::SolveTransposed(block(t), stride_, part);
  if (chained_ && t + 1 < num_blocks_) CarryForward(t, part);
}

void BlockChain::SolveBack(AlignedDoubles& b) {
  for (int t = num_blocks_ - 1; t >= 0; --t) {
    double* part = b.data() + static_cast<std::ptrdiff_t>(t) * stride_;
    if (chained_ && t + 1 < num_blocks_) CarryBack(t, part);
    kernels::SolveUpper(block(t), stride_, part);
  }
}

// b of the next block -= (U^-T C)^T b
void BlockChain::CarryForward(int t, double* b) {
  double* minus = scratch_.data();
  double* next = b + stride_;
  for (int i = 0; i < stride_; ++i) minus[i] = -b[i];
  if (!slim(t)) {
    kernels::AddCombination(minus, coupling(t), stride_, stride_, next, stride_);
    return;
  }
  kernels::AddCombinationOfLower(minus, coupling(t), next, stride_);
  for (int r = 0; r < links_[static_cast<size_t>(t)].rows; ++r) {
    kernels::Axpy(kernels::Dot(minus, left(t, r), stride_), right(t, r), next, stride_);
  }
}

// b -= U^-T C (b of the next block)
void BlockChain::CarryBack(int t, double* b) {
  double* minus = scratch_.data();
  for (int i = 0; i < stride_; ++i) minus[i] = -b[stride_ + i];
  if (!slim(t)) {
    kernels::AddProducts(coupling(t), stride_, stride_, minus, b, stride_);
    return;
  }
  kernels::AddProductsOfLower(coupling(t), minus, b, stride_);
  for (int r = 0; r < links_[static_cast<size_t>(t)].rows; ++r) {
    kernels::Axpy(kernels::Dot(minus, right(t, r), stride_), left(t, r), b, stride_);
  }
}

}  // namespace legopt

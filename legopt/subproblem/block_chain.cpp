#include "legopt/subproblem/block_chain.h"

#include <algorithm>

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
  min_pivot_.resize(size);
  scratch_.resize(static_cast<size_t>(stride) * (1 + kMostRows));
}

void BlockChain::SetSlim(int t, int rows) {
  links_[static_cast<size_t>(t)] = {true, rows, num_rows_};
  num_rows_ += static_cast<size_t>(rows);
  const size_t entries = num_rows_ * static_cast<size_t>(stride_);
  left_.resize(std::max(left_.size(), entries));
  right_.resize(std::max(right_.size(), entries));
}

void BlockChain::Fix(size_t i) {
  const auto stride = static_cast<size_t>(stride_);
  const size_t first = i / stride * stride;  // of its block
  const size_t column = i % stride;
  double* row = matrix_.data() + i * stride;
  std::fill(row, row + stride, 0.0);
  for (size_t k = first; k < first + stride; ++k) matrix_[k * stride + column] = 0.0;
  row[column] = 1.0;
  if (!chained_) return;
  const auto t = static_cast<int>(i / stride);
  std::fill_n(coupling_.begin() + static_cast<std::ptrdiff_t>(i * stride), stride, 0.0);
  for (int r = 0; r < links_[static_cast<size_t>(t)].rows; ++r) left(t, r)[column] = 0.0;
  if (t == 0) return;
  for (size_t k = first; k < first + stride; ++k) coupling_[(k - stride) * stride + column] = 0.0;
  for (int r = 0; r < links_[static_cast<size_t>(t) - 1].rows; ++r) right(t - 1, r)[column] = 0.0;
}

bool BlockChain::Factor(double pivot_floor) {
  const auto stride = static_cast<size_t>(stride_);
  for (size_t i = 0; i < min_pivot_.size(); ++i) {
    min_pivot_[i] = std::max(pivot_floor * matrix_[i * stride + i % stride], kLeastPivot);
  }
  for (int t = 0; t < num_blocks_; ++t) {
    const double* pivots = min_pivot_.data() + static_cast<size_t>(t) * stride;
    if (!kernels::FactorUpper(block(t), stride_, pivots)) return false;
    if (!chained_ || t + 1 == num_blocks_) continue;
    if (slim(t)) {
      EliminateSlim(t);
    } else {
      Eliminate(t);
    }
  }
  return true;
}

void BlockChain::Eliminate(int t) {
  kernels::SolveTransposedBlock(block(t), stride_, coupling(t));
  kernels::AddProductsUpper(-1.0, coupling(t), stride_, coupling(t), stride_, stride_, block(t + 1), stride_);
}

// With T = U^-T C, z = U^-T l: (T + sum z r^T)^T (T + sum z r^T) = T^T T + sum (q r^T + r q^T) for
// q_a = T^T z_a + 1/2 sum_b (z_a . z_b) r_b.
void BlockChain::EliminateSlim(int t) {
  const int rows = links_[static_cast<size_t>(t)].rows;
  kernels::SolveTransposedLower(block(t), stride_, coupling(t));
  kernels::SubtractProductsOfLower(coupling(t), block(t + 1), stride_);
  if (rows == 0) return;
  for (int a = 0; a < rows; ++a) kernels::SolveTransposed(block(t), stride_, left(t, a));
  std::fill(scratch_.begin(), scratch_.end(), 0.0);
  for (int a = 0; a < rows; ++a) {
    double* q = scratch_.data() + static_cast<std::ptrdiff_t>(a) * stride_;
    kernels::AddCombinationOfLower(left(t, a), coupling(t), q, stride_);
    for (int b = 0; b < rows; ++b) {
      kernels::Axpy(0.5 * kernels::Dot(left(t, a), left(t, b), stride_), right(t, b), q, stride_);
    }
  }
  kernels::AddProductsUpper(-1.0, scratch_.data(), stride_, right(t, 0), stride_, rows, block(t + 1), stride_);
  kernels::AddProductsUpper(-1.0, right(t, 0), stride_, scratch_.data(), stride_, rows, block(t + 1), stride_);
}

void BlockChain::Solve(std::vector<double>& b) {
  for (int t = 0; t < num_blocks_; ++t) {
    double* part = b.data() + static_cast<std::ptrdiff_t>(t) * stride_;
    kernels::SolveTransposed(block(t), stride_, part);
    if (chained_ && t + 1 < num_blocks_) CarryForward(t, part);
  }
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

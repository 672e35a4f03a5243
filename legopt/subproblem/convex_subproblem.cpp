#include "legopt/subproblem/convex_subproblem.h"

#include <algorithm>
#include <cmath>

#include "legopt/subproblem/dense_kernels.h"

namespace legopt {

ConvexSubproblem::ConvexSubproblem(int num_blocks, int block_size)
    : num_blocks_(num_blocks), block_size_(block_size), stride_(PaddedSize(block_size)) {
  const auto total = static_cast<size_t>(num_blocks) * static_cast<size_t>(stride_);
  diagonal_.assign(total * static_cast<size_t>(stride_), 0.0);
  coupling_.assign(total * static_cast<size_t>(stride_), 0.0);
  gradient_.assign(total, 0.0);
  lower_.assign(total, 0.0);
  upper_.assign(total, 0.0);
  padded_.assign(total, 0.0);
}

void ConvexSubproblem::Clear() {
  constant_ = 0.0;
  max_weight_ = 0.0;
  std::fill(diagonal_.begin(), diagonal_.end(), 0.0);
  if (has_coupling_) std::fill(coupling_.begin(), coupling_.end(), 0.0);
  has_coupling_ = false;
  std::fill(gradient_.begin(), gradient_.end(), 0.0);
  rows_.clear();
  coefficients_.clear();
}

void ConvexSubproblem::AddCost(int block, const LinearModel& model) {
  for (int i = 0; i < model.rows(); ++i) constant_ += model.value(i) * model.value(i);
  if (model.rows() == 0) return;
  for (int k = 0; k < model.num_waypoints(); ++k) {
    double* gradient = gradient_.data() + static_cast<size_t>(block + k) * static_cast<size_t>(stride_);
    for (int i = 0; i < model.rows(); ++i) kernels::Axpy(2.0 * model.value(i), model.row(k, i), gradient, stride_);
    kernels::AddProductsUpper(2.0, model.row(k, 0), stride_, model.row(k, 0), stride_, model.rows(),
                              diagonal_.data() + BlockOffset(block + k), stride_);
  }
  if (model.num_waypoints() < 2) return;
  has_coupling_ = true;
  double* coupling = coupling_.data() + BlockOffset(block);
  for (int i = 0; i < model.rows(); ++i) {
    for (int j = 0; j < block_size_; ++j) {
      const double c = 2.0 * model.row(0, i)[j];
      if (c != 0.0) kernels::Axpy(c, model.row(1, i), coupling + static_cast<size_t>(j * stride_), stride_);
    }
  }
}

void ConvexSubproblem::AddPenalties(int block, const LinearModel& model, TermKind kind, double weight) {
  const auto stride = static_cast<size_t>(stride_);
  for (int i = 0; i < model.rows(); ++i) {
    Row row;
    row.block = block;
    row.num_blocks = model.num_waypoints();
    row.absolute = kind == TermKind::kEquality;
    row.weight = weight;
    row.offset = model.value(i);
    row.begin = coefficients_.size();
    for (int k = 0; k < row.num_blocks; ++k) {
      coefficients_.insert(coefficients_.end(), model.row(k, i), model.row(k, i) + stride);
    }
    rows_.push_back(row);
  }
  max_weight_ = std::max(max_weight_, weight);
}

void ConvexSubproblem::SetBounds(Eigen::Ref<const Eigen::VectorXd> lower, Eigen::Ref<const Eigen::VectorXd> upper) {
  for (int t = 0; t < num_blocks_; ++t) {
    const size_t padded = static_cast<size_t>(t) * static_cast<size_t>(stride_);
    const double* l = lower.data() + static_cast<Eigen::Index>(t) * block_size_;
    const double* u = upper.data() + static_cast<Eigen::Index>(t) * block_size_;
    std::copy(l, l + block_size_, lower_.begin() + static_cast<std::ptrdiff_t>(padded));
    std::copy(u, u + block_size_, upper_.begin() + static_cast<std::ptrdiff_t>(padded));
  }
}

double ConvexSubproblem::Value(Eigen::Ref<const Eigen::VectorXd> dx) const {
  const auto stride = static_cast<size_t>(stride_);
  for (int t = 0; t < num_blocks_; ++t) {
    std::copy(dx.data() + static_cast<Eigen::Index>(t) * block_size_,
              dx.data() + static_cast<Eigen::Index>(t + 1) * block_size_,
              padded_.data() + static_cast<size_t>(t) * stride);
  }
  double value = constant_;
  for (int t = 0; t < num_blocks_; ++t) {
    const double* x = padded_.data() + static_cast<size_t>(t) * stride;
    value += kernels::Dot(gradient_.data() + static_cast<size_t>(t) * stride, x, stride_);
    for (int i = 0; i < block_size_; ++i) {
      const double* row = hessian(t) + static_cast<size_t>(i) * stride;
      value += 0.5 * row[i] * x[i] * x[i];
      for (int j = i + 1; j < block_size_; ++j) value += row[j] * x[i] * x[j];
    }
    if (!has_coupling_ || t + 1 == num_blocks_) continue;
    for (int i = 0; i < block_size_; ++i) {
      value += x[i] * kernels::Dot(coupling(t) + static_cast<size_t>(i) * stride, x + stride, stride_);
    }
  }
  for (const Row& row : rows_) {
    const double* x = padded_.data() + static_cast<size_t>(row.block) * stride;
    double a = row.offset;
    for (int k = 0; k < row.num_blocks; ++k) {
      a += kernels::Dot(coefficients(row, k), x + static_cast<size_t>(k) * stride, stride_);
    }
    value += row.weight * (row.absolute ? std::abs(a) : std::max(0.0, a));
  }
  return value;
}

}  // namespace legopt

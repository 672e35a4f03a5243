#include "legopt/solvers/subproblem/convex_subproblem.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>

#include "legopt/solvers/subproblem/block_kernels.h"
#include "legopt/solvers/subproblem/dense_kernels.h"

namespace legopt {
namespace {

constexpr int kTile = kernels::kLanes;

/// Non-zero entries of a row: at most as many as a row for the rotation of the base has.
struct SparseRow {
  static constexpr int kMost = 4;
  int count = 0;
  int place[kMost];
  double entry[kMost];
};

/// Returns false if the row has more entries.
bool ReadSparse(const double* row, int stride, SparseRow* sparse) {
  sparse->count = 0;
  for (int v = 0; v < stride; v += kTile) {
    unsigned bits = kernels::NonZeros(kernels::Load(row + v));
    for (; bits != 0; bits &= bits - 1) {
      if (sparse->count == SparseRow::kMost) return false;
      const int place = v + std::countr_zero(bits);
      sparse->place[sparse->count] = place;
      sparse->entry[sparse->count++] = row[place];
    }
  }
  return true;
}

/// Adds 2 a b^T to M; only the upper triangle if `upper`. Returns whether all of it lies in the tiles along the
/// diagonal.
bool AddProduct(const SparseRow& a, const SparseRow& b, bool upper, double* m, int stride) {
  bool tiled = true;
  for (int i = 0; i < a.count; ++i) {
    for (int j = 0; j < b.count; ++j) {
      if (upper && b.place[j] < a.place[i]) continue;
      m[static_cast<std::ptrdiff_t>(a.place[i]) * stride + b.place[j]] += 2.0 * a.entry[i] * b.entry[j];
      tiled = tiled && a.place[i] / kTile == b.place[j] / kTile;
    }
  }
  return tiled;
}

}  // namespace

ConvexSubproblem::ConvexSubproblem(int num_blocks, int block_size)
    : num_blocks_(num_blocks), block_size_(block_size), stride_(PaddedSize(block_size)) {
  const auto total = static_cast<size_t>(num_blocks) * static_cast<size_t>(stride_);
  diagonal_.assign(total * static_cast<size_t>(stride_), 0.0);
  coupling_.assign(total * static_cast<size_t>(stride_), 0.0);
  gradient_.assign(total, 0.0);
  lower_.assign(total, 0.0);
  upper_.assign(total, 0.0);
  padded_.assign(total, 0.0);
  tiled_diagonal_.assign(static_cast<size_t>(num_blocks), 1);
  tiled_coupling_.assign(static_cast<size_t>(num_blocks), 1);
  for (int j = 0; j < stride_; j += kTile) all_columns_.push_back(j);
}

void ConvexSubproblem::ClearBlock(AlignedDoubles& blocks, int t, bool tiled) {
  double* const block = blocks.data() + BlockOffset(t);
  for (int i = 0; i < stride_; ++i) {
    double* const row = block + static_cast<std::ptrdiff_t>(i) * stride_;
    const std::ptrdiff_t tile = i / kTile * std::ptrdiff_t{kTile};
    if (tiled) {
      kernels::Store(row + tile, kernels::Lanes{});
    } else {
      std::fill_n(row, stride_, 0.0);
    }
  }
}

void ConvexSubproblem::Clear() {
  constant_ = 0.0;
  max_weight_ = 0.0;
  for (int t = 0; t < num_blocks_; ++t) {
    ClearBlock(diagonal_, t, hessian_is_tiled(t));
    if (has_coupling_) ClearBlock(coupling_, t, coupling_is_tiled(t));
  }
  std::fill(tiled_diagonal_.begin(), tiled_diagonal_.end(), 1);
  std::fill(tiled_coupling_.begin(), tiled_coupling_.end(), 1);
  has_coupling_ = false;
  std::fill(gradient_.begin(), gradient_.end(), 0.0);
  rows_.clear();
  coefficients_.clear();
}

void ConvexSubproblem::AddCost(int block, const LinearModel& model) {
  for (int i = 0; i < model.rows(); ++i) constant_ += model.value(i) * model.value(i);
  if (model.rows() == 0) return;
  if (model.num_waypoints() > 1) has_coupling_ = true;
  AddDenseCost(block, model, AddSparseCost(block, model));
}

/// Adds rows with few entries, from the first on, up to the first row with more. Returns the number of rows added.
int ConvexSubproblem::AddSparseCost(int block, const LinearModel& model) {
  SparseRow rows[2];
  for (int i = 0; i < model.rows(); ++i) {
    for (int k = 0; k < model.num_waypoints(); ++k) {
      if (!ReadSparse(model.row(k, i), stride_, &rows[k])) return i;
    }
    for (int k = 0; k < model.num_waypoints(); ++k) {
      const SparseRow& row = rows[k];
      double* gradient = gradient_.data() + static_cast<size_t>(block + k) * static_cast<size_t>(stride_);
      for (int j = 0; j < row.count; ++j) gradient[row.place[j]] += 2.0 * model.value(i) * row.entry[j];
      const bool tiled = AddProduct(row, row, true, diagonal_.data() + BlockOffset(block + k), stride_);
      if (!tiled) tiled_diagonal_[static_cast<size_t>(block + k)] = 0;
    }
    if (model.num_waypoints() < 2) continue;
    const bool tiled = AddProduct(rows[0], rows[1], false, coupling_.data() + BlockOffset(block), stride_);
    if (!tiled) tiled_coupling_[static_cast<size_t>(block)] = 0;
  }
  return model.rows();
}

/// Adds the rows from `first` on.
void ConvexSubproblem::AddDenseCost(int block, const LinearModel& model, int first) {
  const int count = model.rows() - first;
  if (count == 0) return;
  const auto rows = static_cast<size_t>(count);
  if (twos_.size() < rows) {
    twos_.resize(rows, 2.0);
    scratch_.resize(kernels::PackedSquares<double>::kScratch * rows);
  }
  for (int k = 0; k < model.num_waypoints(); ++k) {
    double* gradient = gradient_.data() + static_cast<size_t>(block + k) * static_cast<size_t>(stride_);
    const double* const jacobian = model.row(k, first);
    for (int i = first; i < model.rows(); ++i) kernels::Axpy(2.0 * model.value(i), model.row(k, i), gradient, stride_);
    const kernels::WeightedRows<double> run = {jacobian, twos_.data(), count};
    double* const square = diagonal_.data() + BlockOffset(block + k);
    kernels::ChosenKernels<double>().add_squares({{&run, 1}, all_columns_, scratch_.data()}, square, square, stride_);
    tiled_diagonal_[static_cast<size_t>(block + k)] = 0;
  }
  if (model.num_waypoints() < 2) return;
  tiled_coupling_[static_cast<size_t>(block)] = 0;
  double* coupling = coupling_.data() + BlockOffset(block);
  for (int i = first; i < model.rows(); ++i) {
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

/// Returns the part of 1/2 x^T H x from diagonal block t and its coupling with the next block; `x` starts at block t.
double ConvexSubproblem::QuadraticValue(int t, const double* x) const {
  const bool coupled = has_coupling_ && t + 1 < num_blocks_;
  double value = 0.0;
  for (int i = 0; i < block_size_; ++i) {
    const std::ptrdiff_t begin = static_cast<std::ptrdiff_t>(i) * stride_;
    const int tile = i / kTile * kTile, next = tile + kTile;
    const double* row = hessian(t) + begin;
    double product = 0.5 * row[i] * x[i];
    for (int j = i + 1; j < next; ++j) product += row[j] * x[j];
    if (!hessian_is_tiled(t)) product += kernels::Dot(row + next, x + next, stride_ - next);
    if (coupled) {
      const double* beside = coupling(t) + begin;
      product += coupling_is_tiled(t) ? kernels::Dot(beside + tile, x + stride_ + tile, kTile)
                                      : kernels::Dot(beside, x + stride_, stride_);
    }
    value += product * x[i];
  }
  return value;
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
    value += kernels::Dot(gradient_.data() + static_cast<size_t>(t) * stride, x, stride_) + QuadraticValue(t, x);
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

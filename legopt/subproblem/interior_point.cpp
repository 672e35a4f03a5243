#include "legopt/subproblem/interior_point.h"

#include <algorithm>
#include <cmath>

#include "legopt/subproblem/dense_kernels.h"

namespace legopt {
namespace {

constexpr int kMaxIterations = 60;
constexpr double kFixedWidth = 1e-14;  // bounds closer than this fix the variable
constexpr double kStepToBoundary = 0.995;
constexpr double kRelativeGap = 1e-12;       // of the scaled objective: the limit of double precision
constexpr double kMinPivot = 1e-14;          // of the diagonal before elimination
constexpr double kPivotFloorGrowth = 100.0;  // when a direction came out without finite numbers
constexpr double kMaxPivotFloor = 1e-6;
constexpr double kStalledStep = 1e-8;
constexpr double kStartInset = 0.1;     // share of a box's width kept free at the start
constexpr double kStartBarrier = 0.05;  // of the mean row residual
constexpr double kMinStartBarrier = 1e-7;
constexpr int kDense = -1;

}  // namespace

SubproblemSolver::Result InteriorPointSolver::Solve(const ConvexSubproblem& problem, const Accuracy& accuracy,
                                                    Eigen::Ref<Eigen::VectorXd> dx) {
  Prepare(problem);
  StartingPoint(problem);
  Result result;
  result.status = Status::kIterationLimit;
  for (; result.iterations < kMaxIterations; ++result.iterations) {
    Residuals(problem);
    const double gap = x_.Gap() + y_.Gap();
    if (!std::isfinite(gap)) {
      result.status = Status::kFailed;
      break;
    }
    result.gap = gap * scale_;
    if (IsSolved(problem, accuracy, gap)) {
      result.status = Status::kSolved;
      break;
    }
    if (!AffineDirection()) break;
    const double affine_step = MaxStep();
    const double affine = (x_.GapAfter(affine_step) + y_.GapAfter(affine_step)) / gap;
    if (!Direction(affine * affine * affine * gap / static_cast<double>(num_products_), true)) break;
    const double step = std::min(1.0, kStepToBoundary * MaxStep());
    x_.Move(step);
    y_.Move(step);
    if (step < kStalledStep) break;
  }
  const int n = problem.block_size();
  for (int t = 0; t < num_blocks_; ++t) {
    for (int i = 0; i < n; ++i) {
      const auto k = static_cast<size_t>(t * stride_ + i);
      dx[static_cast<Eigen::Index>(t) * n + i] = std::clamp(x_.value[k], problem.lower()[k], problem.upper()[k]);
    }
  }
  return result;
}

void InteriorPointSolver::Prepare(const ConvexSubproblem& problem) {
  stride_ = problem.stride();
  num_blocks_ = problem.num_blocks();
  num_x_ = static_cast<size_t>(stride_) * static_cast<size_t>(num_blocks_);
  num_y_ = problem.rows().size();
  scale_ = problem.max_weight() > 0.0 ? problem.max_weight() : 1.0;
  x_.Reset(num_x_);
  y_.Reset(num_y_);
  rd_.resize(num_x_);
  rp_.resize(y_.size());
  weight_.resize(y_.size());
  GroupRows(problem);
  CopyHessian(problem);
  ChooseLinks();
  fixed_.clear();
  for (size_t i = 0; i < num_x_; ++i) {
    const double lower = problem.lower()[i];
    const double upper = problem.upper()[i];
    if (upper - lower < kFixedWidth) {
      fixed_.push_back(i);
      x_.SetFixed(i, 0.5 * (lower + upper));
    } else {
      x_.SetFree(i, lower, upper);
    }
  }
  for (size_t i = 0; i < num_y_; ++i) {
    const ConvexSubproblem::Row& row = problem.rows()[i];
    const double limit = row.weight / scale_;
    y_.SetFree(i, row.absolute ? -limit : 0.0, limit);
  }
  num_products_ = 2 * (num_x_ - fixed_.size() + num_y_);
}

void InteriorPointSolver::GroupRows(const ConvexSubproblem& problem) {
  groups_.clear();
  chain_ = problem.has_coupling();
  for (size_t i = 0; i < num_y_; ++i) {
    const ConvexSubproblem::Row& row = problem.rows()[i];
    const auto block = static_cast<size_t>(row.block);
    chain_ = chain_ || row.num_blocks > 1;
    if (groups_.empty() || groups_.back().block != block || groups_.back().num_blocks != row.num_blocks) {
      groups_.push_back({block, row.num_blocks, i, 0, problem.coefficients(row)});
    }
    ++groups_.back().count;
  }
}

void InteriorPointSolver::CopyHessian(const ConvexSubproblem& problem) {
  const auto stride = static_cast<size_t>(stride_);
  const double inverse = 1.0 / scale_;
  hessian_.resize(num_x_ * stride);
  for (int t = 0; t < num_blocks_; ++t) {
    const double* from = problem.hessian(t);
    double* to = Block(hessian_, t);
    for (size_t i = 0; i < stride; ++i) {
      for (size_t j = i; j < stride; ++j) {
        const double value = inverse * from[i * stride + j];
        to[i * stride + j] = value;
        to[j * stride + i] = value;
      }
    }
  }
  if (!chain_) return;
  hessian_coupling_.resize(num_x_ * stride);
  const double* from = problem.coupling(0);
  for (size_t k = 0; k < num_x_ * stride; ++k) hessian_coupling_[k] = inverse * from[k];
}

void InteriorPointSolver::ChooseLinks() {
  slim_rows_.assign(static_cast<size_t>(num_blocks_), 0);
  if (!chain_) return;
  for (const RowGroup& group : groups_) {
    if (group.num_blocks > 1) slim_rows_[group.block] += group.count;
  }
  for (int t = 0; t + 1 < num_blocks_; ++t) {
    int& rows = slim_rows_[static_cast<size_t>(t)];
    if (rows > BlockChain::kMostRows || !kernels::IsLower(Block(hessian_coupling_, t), stride_)) rows = kDense;
  }
}

void InteriorPointSolver::StartRow(size_t i, double a, double barrier) {
  const double half = 0.5 * (y_.upper[i] - y_.lower[i]);
  const double t = a * half / (barrier + std::hypot(barrier, a * half));  // a = barrier (1/(uy - y) - 1/(y - ly))
  y_.value[i] = y_.lower[i] + half * (1.0 + t);
  y_.z_lower[i] = barrier / (half * (1.0 + t));
  y_.z_upper[i] = barrier / (half * (1.0 - t));
  if (t > 0.0) {  // the small one of the two is exact, the other follows from the residual
    y_.z_upper[i] = a + y_.z_lower[i];
  } else {
    y_.z_lower[i] = y_.z_upper[i] - a;
  }
}

void InteriorPointSolver::StartingPoint(const ConvexSubproblem& problem) {
  for (size_t i = 0; i < num_x_; ++i) {
    if (x_.free[i] == 0.0) continue;
    const double inset = kStartInset * (x_.upper[i] - x_.lower[i]);
    x_.value[i] = std::clamp(0.0, x_.lower[i] + inset, x_.upper[i] - inset);
  }
  row_scratch_.assign(y_.size(), 0.0);
  for (size_t i = 0; i < num_y_; ++i) row_scratch_[i] = problem.rows()[i].offset;
  AddRowProducts(x_.value, row_scratch_);
  double mean = 0.0;
  for (size_t i = 0; i < num_y_; ++i) mean += std::abs(row_scratch_[i]) * y_.upper[i];
  if (num_y_ > 0) mean /= static_cast<double>(num_y_);
  const double barrier = std::max(kStartBarrier * mean, kMinStartBarrier);
  for (size_t i = 0; i < num_y_; ++i) StartRow(i, row_scratch_[i], barrier);

  x_.Start();
  y_.Start();
  // With z still zero the dual residual is H x + g + A'y; zl - zu must equal it.
  Residuals(problem);
  for (size_t i = 0; i < num_x_; ++i) {
    if (x_.free[i] == 0.0) continue;
    const double slack = 2.0 * barrier / (x_.upper[i] - x_.lower[i]);
    x_.z_lower[i] = std::max(rd_[i], 0.0) + slack;
    x_.z_upper[i] = std::max(-rd_[i], 0.0) + slack;
  }
}

void InteriorPointSolver::AddRowProducts(const std::vector<double>& x, std::vector<double>& product) const {
  const std::ptrdiff_t stride = stride_;
  for (const RowGroup& group : groups_) {
    for (int k = 0; k < group.num_blocks; ++k) {
      kernels::AddProducts(group.coefficients + k * stride, group.num_blocks * stride, group.count,
                           x.data() + (group.block + static_cast<size_t>(k)) * static_cast<size_t>(stride_),
                           product.data() + group.begin, stride_);
    }
  }
}

void InteriorPointSolver::AddTransposedRows(const std::vector<double>& c, std::vector<double>& rhs) const {
  const std::ptrdiff_t stride = stride_;
  for (const RowGroup& group : groups_) {
    for (int k = 0; k < group.num_blocks; ++k) {
      kernels::AddCombination(c.data() + group.begin, group.coefficients + k * stride, group.num_blocks * stride,
                              group.count, Segment(rhs, static_cast<int>(group.block) + k), stride_);
    }
  }
}

void InteriorPointSolver::Residuals(const ConvexSubproblem& problem) {
  const double inverse = 1.0 / scale_;
  for (size_t i = 0; i < num_x_; ++i) rd_[i] = inverse * problem.gradient()[i] - x_.z_lower[i] + x_.z_upper[i];
  for (int t = 0; t < num_blocks_; ++t) {
    const double* x = Segment(x_.value, t);
    double* rd = Segment(rd_, t);
    kernels::AddCombination(x, Block(hessian_, t), stride_, stride_, rd, stride_);
    if (!problem.has_coupling() || t + 1 == num_blocks_) continue;
    const double* coupling = Block(hessian_coupling_, t);
    if (slim_rows_[static_cast<size_t>(t)] != kDense) {
      kernels::AddProductsOfLower(coupling, x + stride_, rd, stride_);
      kernels::AddCombinationOfLower(x, coupling, rd + stride_, stride_);
    } else {
      kernels::AddProducts(coupling, stride_, stride_, x + stride_, rd, stride_);
      kernels::AddCombination(x, coupling, stride_, stride_, rd + stride_, stride_);
    }
  }
  AddTransposedRows(y_.value, rd_);
  for (size_t i = 0; i < num_y_; ++i) rp_[i] = problem.rows()[i].offset + y_.z_lower[i] - y_.z_upper[i];
  std::fill(rp_.begin() + static_cast<std::ptrdiff_t>(num_y_), rp_.end(), 0.0);
  AddRowProducts(x_.value, rp_);
}

double InteriorPointSolver::Decrease(const ConvexSubproblem& problem) const {
  // Residuals left H x = rd - g - A'y + zl - zu and A x + b = rp - wl + wu.
  const double inverse = 1.0 / scale_;
  double linear = 0.0, quadratic = 0.0;
  for (size_t i = 0; i < num_x_; ++i) {
    const double gradient = inverse * problem.gradient()[i];
    linear += gradient * x_.value[i];
    quadratic += (rd_[i] + x_.z_lower[i] - x_.z_upper[i] - gradient) * x_.value[i];
  }
  double decrease = 0.0;
  for (size_t i = 0; i < num_y_; ++i) {
    const ConvexSubproblem::Row& row = problem.rows()[i];
    const double a = rp_[i] - y_.z_lower[i] + y_.z_upper[i];
    quadratic -= y_.value[i] * (a - row.offset);
    const double weight = row.weight / scale_;
    const auto penalty = [&](double value) { return row.absolute ? std::abs(value) : std::max(0.0, value); };
    decrease += weight * (penalty(row.offset) - penalty(a));
  }
  return decrease - linear - 0.5 * quadratic;
}

bool InteriorPointSolver::IsSolved(const ConvexSubproblem& problem, const Accuracy& accuracy, double gap) const {
  if (gap <= std::max(accuracy.gap / scale_, kRelativeGap * static_cast<double>(num_products_))) return true;
  if (accuracy.share >= 1.0) return false;
  const double decrease = Decrease(problem), possible = decrease + gap;
  return possible * scale_ <= accuracy.negligible || decrease >= accuracy.share * possible;
}

bool InteriorPointSolver::AffineDirection() {
  for (double pivot_floor = kMinPivot; pivot_floor <= kMaxPivotFloor; pivot_floor *= kPivotFloorGrowth) {
    if (Factor(pivot_floor) && Direction(0.0, false)) return true;
  }
  return false;
}

bool InteriorPointSolver::Factor(double pivot_floor) {
  const auto stride = static_cast<size_t>(stride_);
  const size_t entries = stride * stride;
  chain_matrix_.Reset(num_blocks_, stride_, chain_);
  for (int t = 0; t < num_blocks_; ++t) {
    std::copy_n(Block(hessian_, t), entries, chain_matrix_.block(t));
    if (!chain_ || t + 1 == num_blocks_) continue;
    std::copy_n(Block(hessian_coupling_, t), entries, chain_matrix_.coupling(t));
    const int rows = slim_rows_[static_cast<size_t>(t)];
    if (rows != kDense) chain_matrix_.SetSlim(t, rows);
  }
  y_.BarrierHessian(weight_);
  for (size_t i = 0; i < weight_.size(); ++i) weight_[i] = y_.free[i] / (weight_[i] + (1.0 - y_.free[i]));
  AddRows();
  x_.BarrierHessian(theta_);
  for (int t = 0; t < num_blocks_; ++t) {
    const double* theta = Segment(theta_, t);
    for (size_t i = 0; i < stride; ++i) chain_matrix_.block(t)[i * stride + i] += theta[i];
  }
  for (const size_t i : fixed_) chain_matrix_.Fix(i);
  return chain_matrix_.Factor(pivot_floor);
}

void InteriorPointSolver::AddRows() {
  rows_so_far_.assign(static_cast<size_t>(num_blocks_), 0);
  for (const RowGroup& group : groups_) {
    const int width = group.num_blocks * stride_;
    const auto entries = static_cast<size_t>(group.count) * static_cast<size_t>(width);
    if (scaled_rows_.size() < entries) scaled_rows_.resize(entries);
    for (int i = 0; i < group.count; ++i) {
      const double weight = weight_[group.begin + static_cast<size_t>(i)];
      const double* from = group.coefficients + static_cast<std::ptrdiff_t>(i) * width;
      double* to = scaled_rows_.data() + static_cast<std::ptrdiff_t>(i) * width;
      for (int j = 0; j < width; ++j) to[j] = weight * from[j];
    }
    const auto block = static_cast<int>(group.block);
    for (int k = 0; k < group.num_blocks; ++k) {
      const std::ptrdiff_t begin = static_cast<std::ptrdiff_t>(k) * stride_;
      kernels::AddProductsUpper(1.0, scaled_rows_.data() + begin, width, group.coefficients + begin, width, group.count,
                                chain_matrix_.block(block + k), stride_);
    }
    if (group.num_blocks > 1) AddCoupling(group, scaled_rows_.data());
  }
}

void InteriorPointSolver::AddCoupling(const RowGroup& group, const double* scaled) {
  const auto block = static_cast<int>(group.block);
  const int width = group.num_blocks * stride_;
  if (!chain_matrix_.slim(block)) {
    kernels::AddProductsFull(1.0, scaled, width, group.coefficients + stride_, width, group.count,
                             chain_matrix_.coupling(block), stride_);
    return;
  }
  for (int i = 0; i < group.count; ++i) {
    const std::ptrdiff_t begin = static_cast<std::ptrdiff_t>(i) * width;
    const int row = rows_so_far_[group.block]++;
    std::copy_n(scaled + begin, stride_, chain_matrix_.left(block, row));
    std::copy_n(group.coefficients + begin + stride_, stride_, chain_matrix_.right(block, row));
  }
}

bool InteriorPointSolver::Direction(double sigma, bool corrector) {
  // (H + Theta + A'DA) dx = -rd + drive_x - A'D (rp + drive_y);  dy = D (A dx + rp + drive_y)
  x_.Aim(sigma, corrector);
  y_.Aim(sigma, corrector);
  rhs_.resize(num_x_);
  for (size_t i = 0; i < num_x_; ++i) rhs_[i] = x_.drive[i] - rd_[i];
  row_scratch_.resize(y_.size());
  for (size_t i = 0; i < y_.size(); ++i) row_scratch_[i] = -weight_[i] * (rp_[i] + y_.drive[i]);
  AddTransposedRows(row_scratch_, rhs_);
  for (const size_t i : fixed_) rhs_[i] = 0.0;
  chain_matrix_.Solve(rhs_);
  double size = 0.0;
  for (const double dx : rhs_) size += std::abs(dx);
  if (!std::isfinite(size)) return false;
  std::copy(rhs_.begin(), rhs_.end(), x_.step.begin());
  for (size_t i = 0; i < y_.size(); ++i) y_.step[i] = rp_[i] + y_.drive[i];
  AddRowProducts(x_.step, y_.step);
  for (size_t i = 0; i < y_.size(); ++i) y_.step[i] *= weight_[i];
  x_.CompleteDirection();
  y_.CompleteDirection();
  return true;
}

double InteriorPointSolver::MaxStep() const { return 1.0 / std::max(x_.InverseMaxStep(), y_.InverseMaxStep()); }

}  // namespace legopt

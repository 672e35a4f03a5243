#include "legopt/optimize/interior_point.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "legopt/optimize/dense_kernels.h"

namespace legopt {
namespace {

constexpr int kMaxIterations = 60;
constexpr double kFixedWidth = 1e-14;        // bounds closer than this fix the variable
constexpr double kStepToBoundary = 0.995;
constexpr double kRelativeGap = 1e-12;       // of the scaled objective: the limit of double precision
constexpr double kMinPivot = 1e-13;
constexpr double kStalledStep = 1e-8;
constexpr double kStartInset = 0.1;          // share of a box's width kept free at the start
constexpr double kStartBarrier = 0.05;       // of the mean row residual
constexpr double kMinStartBarrier = 1e-7;

}  // namespace

SubproblemSolver::Result InteriorPointSolver::Solve(const ConvexSubproblem& problem, double accuracy,
                                                    Eigen::Ref<Eigen::VectorXd> dx) {
  Prepare(problem);
  StartingPoint(problem);
  Result result;
  result.status = Status::kIterationLimit;
  const double tolerance = std::max(accuracy / scale_, kRelativeGap * static_cast<double>(num_products_));
  for (; result.iterations < kMaxIterations; ++result.iterations) {
    Residuals(problem);
    const double gap = Gap();
    if (!std::isfinite(gap)) {
      result.status = Status::kFailed;
      break;
    }
    result.gap = gap * scale_;
    if (gap <= tolerance) {
      result.status = Status::kSolved;
      break;
    }
    if (!Factor(problem)) break;
    Direction(problem, 0.0, false);
    const double affine = GapAfter(MaxStep()) / gap;
    Direction(problem, affine * affine * affine * gap / static_cast<double>(num_products_), true);
    const double step = std::min(1.0, kStepToBoundary * MaxStep());
    Move(step);
    if (step < kStalledStep) break;
  }
  const int n = problem.block_size();
  for (int t = 0; t < num_blocks_; ++t) {
    for (int i = 0; i < n; ++i) {
      const auto k = static_cast<size_t>(t * stride_ + i);
      dx[static_cast<Eigen::Index>(t) * n + i] = std::clamp(x_[k], l_[k], u_[k]);
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
  chain_ = problem.has_coupling();
  for (const ConvexSubproblem::Row& row : problem.rows()) chain_ = chain_ || row.num_blocks > 1;
  matrix_.resize(num_x_ * static_cast<size_t>(stride_));
  if (chain_) coupling_.resize(matrix_.size());
  for (auto* v : {&x_, &zl_, &zu_, &rd_, &dx_, &dzl_, &dzu_, &rhs_}) v->assign(num_x_, 0.0);
  for (auto* v : {&y_, &ly_, &uy_, &wl_, &wu_, &rp_, &dy_, &dwl_, &dwu_, &ax_, &weight_, &row_rhs_}) {
    v->assign(num_y_, 0.0);
  }
  l_ = problem.lower();
  u_ = problem.upper();
  fixed_.assign(num_x_, 0);
  size_t free = 0;
  for (size_t i = 0; i < num_x_; ++i) {
    fixed_[i] = u_[i] - l_[i] < kFixedWidth ? 1 : 0;
    free += fixed_[i] == 0 ? 1 : 0;
  }
  num_products_ = 2 * free + 2 * num_y_;
}

void InteriorPointSolver::StartRow(size_t i, double a, double barrier) {
  const double half = 0.5 * (uy_[i] - ly_[i]);
  const double t = a * half / (barrier + std::hypot(barrier, a * half));  // a = barrier (1/(uy - y) - 1/(y - ly))
  y_[i] = ly_[i] + half * (1.0 + t);
  wl_[i] = barrier / (half * (1.0 + t));
  wu_[i] = barrier / (half * (1.0 - t));
  if (t > 0.0) {  // the small one of the two is exact, the other follows from the residual
    wu_[i] = a + wl_[i];
  } else {
    wl_[i] = wu_[i] - a;
  }
}

void InteriorPointSolver::StartingPoint(const ConvexSubproblem& problem) {
  for (size_t i = 0; i < num_x_; ++i) {
    const double inset = kStartInset * (u_[i] - l_[i]);
    x_[i] = fixed_[i] != 0 ? 0.5 * (l_[i] + u_[i]) : std::clamp(0.0, l_[i] + inset, u_[i] - inset);
  }
  MultiplyRows(problem, x_, ax_);
  double mean = 0.0;
  for (size_t i = 0; i < num_y_; ++i) {
    const ConvexSubproblem::Row& row = problem.rows()[i];
    uy_[i] = row.weight / scale_;
    ly_[i] = row.absolute ? -uy_[i] : 0.0;
    mean += std::abs(ax_[i] + row.offset) * uy_[i];
  }
  if (num_y_ > 0) mean /= static_cast<double>(num_y_);
  const double barrier = std::max(kStartBarrier * mean, kMinStartBarrier);
  for (size_t i = 0; i < num_y_; ++i) StartRow(i, ax_[i] + problem.rows()[i].offset, barrier);

  // With z still zero the dual residual is H x + g + A'y; zl - zu must equal it.
  Residuals(problem);
  for (size_t i = 0; i < num_x_; ++i) {
    if (fixed_[i] != 0) continue;
    const double slack = 2.0 * barrier / (u_[i] - l_[i]);
    zl_[i] = std::max(rd_[i], 0.0) + slack;
    zu_[i] = std::max(-rd_[i], 0.0) + slack;
  }
}

void InteriorPointSolver::MultiplyRows(const ConvexSubproblem& problem, const std::vector<double>& x,
                                       std::vector<double>& ax) const {
  const auto stride = static_cast<size_t>(stride_);
  for (size_t i = 0; i < num_y_; ++i) {
    const ConvexSubproblem::Row& row = problem.rows()[i];
    const double* block = x.data() + static_cast<size_t>(row.block) * stride;
    double sum = kernels::Dot(problem.coefficients(row), block, stride_);
    if (row.num_blocks > 1) sum += kernels::Dot(problem.coefficients(row, 1), block + stride, stride_);
    ax[i] = sum;
  }
}

void InteriorPointSolver::AddTransposed(const ConvexSubproblem& problem, const std::vector<double>& y,
                                        std::vector<double>& out) const {
  const auto stride = static_cast<size_t>(stride_);
  for (size_t i = 0; i < num_y_; ++i) {
    const ConvexSubproblem::Row& row = problem.rows()[i];
    double* block = out.data() + static_cast<size_t>(row.block) * stride;
    kernels::Axpy(y[i], problem.coefficients(row), block, stride_);
    if (row.num_blocks > 1) kernels::Axpy(y[i], problem.coefficients(row, 1), block + stride, stride_);
  }
}

void InteriorPointSolver::Residuals(const ConvexSubproblem& problem) {
  const auto stride = static_cast<size_t>(stride_);
  const double inverse = 1.0 / scale_;
  for (size_t i = 0; i < num_x_; ++i) rd_[i] = inverse * problem.gradient()[i] - zl_[i] + zu_[i];
  for (int t = 0; t < num_blocks_; ++t) {
    const size_t begin = static_cast<size_t>(t) * stride;
    const double* x = x_.data() + begin;
    double* rd = rd_.data() + begin;
    for (int i = 0; i < problem.block_size(); ++i) {  // symmetric product from the upper triangle
      const double* row = problem.hessian(t) + static_cast<size_t>(i) * stride;
      double own = row[i] * x[i];
      const double c = inverse * x[i];
      for (int j = i + 1; j < problem.block_size(); ++j) {
        own += row[j] * x[j];
        rd[j] += c * row[j];
      }
      rd[i] += inverse * own;
    }
    if (!problem.has_coupling() || t + 1 == num_blocks_) continue;
    for (int i = 0; i < problem.block_size(); ++i) {
      const double* row = problem.coupling(t) + static_cast<size_t>(i) * stride;
      rd[i] += inverse * kernels::Dot(row, x + stride, stride_);
      kernels::Axpy(inverse * x[i], row, rd + stride, stride_);
    }
  }
  AddTransposed(problem, y_, rd_);
  MultiplyRows(problem, x_, ax_);
  for (size_t i = 0; i < num_y_; ++i) rp_[i] = ax_[i] + problem.rows()[i].offset + wl_[i] - wu_[i];
}

double InteriorPointSolver::Gap() const {
  double gap = 0.0;
  for (size_t i = 0; i < num_x_; ++i) gap += zl_[i] * (x_[i] - l_[i]) + zu_[i] * (u_[i] - x_[i]);
  for (size_t i = 0; i < num_y_; ++i) gap += wl_[i] * (y_[i] - ly_[i]) + wu_[i] * (uy_[i] - y_[i]);
  return gap;
}

bool InteriorPointSolver::Factor(const ConvexSubproblem& problem) {
  const auto stride = static_cast<size_t>(stride_);
  const double inverse = 1.0 / scale_;
  const size_t entries = num_x_ * stride;
  const double* hessian = problem.hessian(0);
  for (size_t k = 0; k < entries; ++k) matrix_[k] = inverse * hessian[k];
  if (chain_) {
    const double* coupling = problem.coupling(0);
    for (size_t k = 0; k < entries; ++k) coupling_[k] = inverse * coupling[k];
  }
  for (size_t i = 0; i < num_y_; ++i) weight_[i] = 1.0 / (wl_[i] / (y_[i] - ly_[i]) + wu_[i] / (uy_[i] - y_[i]));
  AddRows(problem);
  for (size_t i = 0; i < num_x_; ++i) {
    if (fixed_[i] != 0) continue;
    matrix_[i * stride + i % stride] += zl_[i] / (x_[i] - l_[i]) + zu_[i] / (u_[i] - x_[i]);
  }
  FixVariables();
  return FactorChain(problem);
}

void InteriorPointSolver::AddRows(const ConvexSubproblem& problem) {
  const auto block_entries = static_cast<size_t>(stride_) * static_cast<size_t>(stride_);
  const std::vector<ConvexSubproblem::Row>& rows = problem.rows();
  for (size_t begin = 0; begin < num_y_;) {  // runs of rows with the same blocks
    size_t end = begin + 1;
    while (end < num_y_ && rows[end].block == rows[begin].block && rows[end].num_blocks == rows[begin].num_blocks) ++end;
    const auto count = static_cast<int>(end - begin);
    const auto block = static_cast<size_t>(rows[begin].block);
    group_rows_.resize(end - begin);
    for (int k = 0; k < rows[begin].num_blocks; ++k) {
      for (size_t i = begin; i < end; ++i) group_rows_[i - begin] = problem.coefficients(rows[i], k);
      kernels::AccumulateUpper(matrix_.data() + (block + static_cast<size_t>(k)) * block_entries, problem.block_size(),
                               stride_, group_rows_.data(), weight_.data() + begin, count);
    }
    for (size_t i = begin; rows[begin].num_blocks > 1 && i < end; ++i) {
      const double* a = problem.coefficients(rows[i], 0);
      double* coupling = coupling_.data() + block * block_entries;
      for (int p = 0; p < problem.block_size(); ++p) {
        kernels::Axpy(weight_[i] * a[p], problem.coefficients(rows[i], 1), coupling + p * stride_, stride_);
      }
    }
    begin = end;
  }
}

void InteriorPointSolver::FixVariables() {
  const auto stride = static_cast<size_t>(stride_);
  for (size_t i = 0; i < num_x_; ++i) {
    if (fixed_[i] == 0) continue;
    const size_t first = i / stride * stride;  // of its block
    const size_t column = i % stride;
    double* row = matrix_.data() + i * stride;
    std::fill(row, row + stride, 0.0);
    for (size_t k = first; k < first + stride; ++k) matrix_[k * stride + column] = 0.0;
    row[column] = 1.0;
    if (!chain_) continue;
    std::fill_n(coupling_.begin() + static_cast<std::ptrdiff_t>(i * stride), stride, 0.0);
    for (size_t k = first; first > 0 && k < first + stride; ++k) coupling_[(k - stride) * stride + column] = 0.0;
  }
}

bool InteriorPointSolver::FactorChain(const ConvexSubproblem& problem) {
  const auto block_entries = static_cast<size_t>(stride_) * static_cast<size_t>(stride_);
  for (int t = 0; t < num_blocks_; ++t) {
    double* block = matrix_.data() + static_cast<size_t>(t) * block_entries;
    if (!kernels::FactorUpper(block, stride_, kMinPivot)) return false;
    if (!chain_ || t + 1 == num_blocks_) continue;
    double* coupling = coupling_.data() + static_cast<size_t>(t) * block_entries;
    kernels::SolveTransposedBlock(block, stride_, coupling);
    group_rows_.resize(static_cast<size_t>(stride_));
    group_weights_.assign(static_cast<size_t>(stride_), -1.0);
    for (int i = 0; i < stride_; ++i) group_rows_[static_cast<size_t>(i)] = coupling + i * stride_;
    kernels::AccumulateUpper(block + block_entries, problem.block_size(), stride_, group_rows_.data(),
                             group_weights_.data(), stride_);
  }
  return true;
}

void InteriorPointSolver::SolveFactored(const ConvexSubproblem& problem) {
  const auto stride = static_cast<size_t>(stride_);
  for (size_t t = 0; t < static_cast<size_t>(num_blocks_); ++t) {
    double* b = rhs_.data() + t * stride;
    kernels::SolveTransposed(matrix_.data() + t * stride * stride, stride_, b);
    if (!chain_ || t + 1 == static_cast<size_t>(num_blocks_)) continue;
    const double* coupling = coupling_.data() + t * stride * stride;
    for (size_t i = 0; i < stride; ++i) kernels::Axpy(-b[i], coupling + i * stride, b + stride, stride_);
  }
  for (size_t t = static_cast<size_t>(num_blocks_); t-- > 0;) {
    double* b = rhs_.data() + t * stride;
    if (chain_ && t + 1 < static_cast<size_t>(num_blocks_)) {
      const double* coupling = coupling_.data() + t * stride * stride;
      for (size_t i = 0; i < stride; ++i) b[i] -= kernels::Dot(coupling + i * stride, b + stride, stride_);
    }
    kernels::SolveUpper(matrix_.data() + t * stride * stride, stride_, b);
  }
  dx_ = rhs_;
  MultiplyRows(problem, dx_, ax_);
}

void InteriorPointSolver::Direction(const ConvexSubproblem& problem, double sigma, bool corrector) {
  // Right-hand sides of the four complementarity equations, second-order terms of the predictor included.
  const double second = corrector ? 1.0 : 0.0;
  for (size_t i = 0; i < num_y_; ++i) {
    const double below = y_[i] - ly_[i];
    const double above = uy_[i] - y_[i];
    const double cl = sigma - wl_[i] * below - second * dwl_[i] * dy_[i];
    const double cu = sigma - wu_[i] * above + second * dwu_[i] * dy_[i];
    dwl_[i] = cl;
    dwu_[i] = cu;
    row_rhs_[i] = -rp_[i] + cu / above - cl / below;
    ax_[i] = weight_[i] * row_rhs_[i];
  }
  for (size_t i = 0; i < num_x_; ++i) {
    if (fixed_[i] != 0) continue;
    const double below = x_[i] - l_[i];
    const double above = u_[i] - x_[i];
    const double cl = sigma - zl_[i] * below - second * dzl_[i] * dx_[i];
    const double cu = sigma - zu_[i] * above + second * dzu_[i] * dx_[i];
    dzl_[i] = cl;
    dzu_[i] = cu;
    rhs_[i] = -rd_[i] + cl / below - cu / above;
  }
  AddTransposed(problem, ax_, rhs_);
  for (size_t i = 0; i < num_x_; ++i) {
    if (fixed_[i] != 0) rhs_[i] = 0.0;
  }
  SolveFactored(problem);
  for (size_t i = 0; i < num_x_; ++i) {
    if (fixed_[i] != 0) continue;
    dzl_[i] = (dzl_[i] - zl_[i] * dx_[i]) / (x_[i] - l_[i]);
    dzu_[i] = (dzu_[i] + zu_[i] * dx_[i]) / (u_[i] - x_[i]);
  }
  for (size_t i = 0; i < num_y_; ++i) {
    dy_[i] = weight_[i] * (ax_[i] - row_rhs_[i]);
    dwl_[i] = (dwl_[i] - wl_[i] * dy_[i]) / (y_[i] - ly_[i]);
    dwu_[i] = (dwu_[i] + wu_[i] * dy_[i]) / (uy_[i] - y_[i]);
  }
}

double InteriorPointSolver::MaxStep() const {
  double inverse = 1.0;  // largest relative decrease; a step of 1/inverse reaches a boundary
  const auto consider = [&inverse](double value, double change) { inverse = std::max(inverse, -change / value); };
  for (size_t i = 0; i < num_x_; ++i) {
    if (fixed_[i] != 0) continue;
    consider(x_[i] - l_[i], dx_[i]);
    consider(u_[i] - x_[i], -dx_[i]);
    consider(zl_[i], dzl_[i]);
    consider(zu_[i], dzu_[i]);
  }
  for (size_t i = 0; i < num_y_; ++i) {
    consider(y_[i] - ly_[i], dy_[i]);
    consider(uy_[i] - y_[i], -dy_[i]);
    consider(wl_[i], dwl_[i]);
    consider(wu_[i], dwu_[i]);
  }
  return 1.0 / inverse;
}

double InteriorPointSolver::GapAfter(double step) const {
  double gap = 0.0;
  for (size_t i = 0; i < num_x_; ++i) {
    const double x = x_[i] + step * dx_[i];
    gap += (zl_[i] + step * dzl_[i]) * (x - l_[i]) + (zu_[i] + step * dzu_[i]) * (u_[i] - x);
  }
  for (size_t i = 0; i < num_y_; ++i) {
    const double y = y_[i] + step * dy_[i];
    gap += (wl_[i] + step * dwl_[i]) * (y - ly_[i]) + (wu_[i] + step * dwu_[i]) * (uy_[i] - y);
  }
  return gap;
}

void InteriorPointSolver::Move(double step) {
  for (size_t i = 0; i < num_x_; ++i) {
    x_[i] += step * dx_[i];
    zl_[i] += step * dzl_[i];
    zu_[i] += step * dzu_[i];
  }
  for (size_t i = 0; i < num_y_; ++i) {
    y_[i] += step * dy_[i];
    wl_[i] += step * dwl_[i];
    wu_[i] += step * dwu_[i];
  }
}

}  // namespace legopt

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
constexpr double kStartInset = 0.05;   // share of a box's width kept free at the start
constexpr double kStartBarrier = 0.5;  // of the mean row residual
constexpr double kMinStartBarrier = 1e-7;

}  // namespace

SubproblemSolver::Result InteriorPointSolver::Solve(const ConvexSubproblem& problem, const Accuracy& accuracy,
                                                    Eigen::Ref<Eigen::VectorXd> dx) {
  Prepare(problem);
  StartingPoint();
  Result result;
  result.status = Status::kIterationLimit;
  for (; result.iterations < kMaxIterations; ++result.iterations) {
    const double gap = x_.gap() + y_.gap();
    if (!std::isfinite(gap)) {
      result.status = Status::kFailed;
      break;
    }
    result.gap = gap * scale_;
    if (IsSolved(accuracy, gap)) {
      result.status = Status::kSolved;
      break;
    }
    if (!AffineDirection()) break;
    const double affine_step = 1.0 / std::max(x_.InverseMaxAffineStep(), y_.InverseMaxAffineStep());
    const double affine = (x_.GapAfterAffine(affine_step) + y_.GapAfterAffine(affine_step)) / gap;
    if (!CorrectedDirection(affine * affine * affine * gap / static_cast<double>(num_products_))) break;
    const double longest = 1.0 / std::max(x_.CompleteDirection(), y_.CompleteDirection());
    const double step = std::min(1.0, kStepToBoundary * longest);
    Move(step);
    if (step < kStalledStep) break;
  }
  TakeStep(problem, dx);
  return result;
}

void InteriorPointSolver::TakeStep(const ConvexSubproblem& problem, Eigen::Ref<Eigen::VectorXd> dx) const {
  const int n = problem.block_size();
  for (Eigen::Index i = 0; i < dx.size(); ++i) {
    const auto k = static_cast<size_t>(i / n * stride_ + i % n);
    dx[i] = fixed_[k];
    if (free_[k] == 0.0) continue;
    const size_t mine = k - static_cast<size_t>(first_block_) * static_cast<size_t>(stride_);
    dx[i] = std::clamp(x_.value[mine], problem.lower()[k], problem.upper()[k]);
  }
}

void InteriorPointSolver::Prepare(const ConvexSubproblem& problem) {
  stride_ = problem.stride();
  scale_ = problem.max_weight() > 0.0 ? problem.max_weight() : 1.0;
  FindFreedom(problem);
  rows_.Pack(problem, {free_, fixed_, shifted_, first_block_, first_block_ + num_blocks_});
  num_x_ = static_cast<size_t>(stride_) * static_cast<size_t>(num_blocks_);
  num_y_ = rows_.size();
  CopyCosts(problem);
  SetBoxes(problem);
  slope_.resize(num_x_);
  row_values_.resize(y_.size());
  row_steps_.resize(y_.size());
  row_scratch_.resize(y_.size());
}

/// What may move: from the first block with such variables to the last.
void InteriorPointSolver::FindFreedom(const ConvexSubproblem& problem) {
  const size_t all = problem.lower().size(), stride = static_cast<size_t>(stride_);
  free_.assign(all, 0.0);
  fixed_.assign(all, 0.0);
  size_t first = all, end = 0;
  shifted_ = false;
  for (size_t i = 0; i < all; ++i) {
    const double lower = problem.lower()[i], upper = problem.upper()[i];
    if (upper - lower < kFixedWidth) {
      fixed_[i] = 0.5 * (lower + upper);
      shifted_ = shifted_ || fixed_[i] != 0.0;
    } else {
      free_[i] = 1.0;
      first = std::min(first, i);
      end = i + 1;
    }
  }
  if (first == all) first = end = 0;
  first_block_ = static_cast<int>(first / stride);
  num_blocks_ = std::max(1, static_cast<int>((end + stride - 1) / stride) - first_block_);
  fixed_decrease_ = 0.0;
  if (!shifted_) return;
  const int n = problem.block_size();
  Eigen::VectorXd dx = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(problem.num_blocks()) * n);
  const double before = problem.Value(dx);
  for (Eigen::Index i = 0; i < dx.size(); ++i) dx[i] = fixed_[static_cast<size_t>(i / n * stride_ + i % n)];
  fixed_decrease_ = (before - problem.Value(dx)) / scale_;
}

void InteriorPointSolver::SetBoxes(const ConvexSubproblem& problem) {
  const size_t begin = static_cast<size_t>(first_block_) * static_cast<size_t>(stride_);
  x_.Reset(num_x_);
  y_.Reset(num_y_);
  weight_.resize(y_.size());
  size_t num_free = 0;
  for (size_t i = 0; i < num_x_; ++i) {
    if (free_[begin + i] == 0.0) {
      x_.SetFixed(i, 0.0);  // where it is stands in the gradient and the offsets
    } else {
      x_.SetFree(i, problem.lower()[begin + i], problem.upper()[begin + i]);
      ++num_free;
    }
  }
  for (size_t i = 0; i < num_y_; ++i) {
    const double limit = rows_.weight(i) / scale_;
    y_.SetFree(i, rows_.absolute(i) ? -limit : 0.0, limit);
  }
  num_products_ = 2 * (num_free + num_y_);
}

InteriorPointSolver::Square InteriorPointSolver::NewSquare(bool tiled) {
  const auto stride = static_cast<size_t>(stride_);
  const Square square = {tiled, hessian_.empty() ? 0 : squares_.size()};
  squares_.resize(square.begin + stride * (tiled ? kernels::kLanes : stride));
  return square;
}

void InteriorPointSolver::CopyCosts(const ConvexSubproblem& problem) {
  const size_t begin = static_cast<size_t>(first_block_) * static_cast<size_t>(stride_);
  gradient_.resize(num_x_);
  for (size_t i = 0; i < num_x_; ++i) gradient_[i] = problem.gradient()[begin + i] / scale_ * free_[begin + i];
  hessian_.clear();
  coupling_.clear();
  for (int t = 0; t < num_blocks_; ++t) CopyHessian(problem, t);
  coupled_costs_ = problem.has_coupling() && num_blocks_ > 1;
  chain_ = coupled_costs_ || rows_.any_between();
  chain_matrix_.Reset(num_blocks_, stride_, chain_);
  for (int t = 0; chain_ && t + 1 < num_blocks_; ++t) CopyCoupling(problem, t);
  if (shifted_) ShiftByFixed(problem);
}

/// Rows and columns of fixed variables are the identity's.
void InteriorPointSolver::CopyHessian(const ConvexSubproblem& problem, int t) {
  const int block = t + first_block_;
  hessian_.push_back(NewSquare(problem.hessian_is_tiled(block)));
  double* const to = Entries(hessian_.back());
  const bool tiled = hessian_.back().tiled;
  const double* const from = problem.hessian(block);
  const double* const free = free_.data() + static_cast<std::ptrdiff_t>(block) * stride_;
  const int step = tiled ? kernels::kLanes : stride_;
  const double inverse = 1.0 / scale_;
  for (int i = 0; i < stride_; ++i) {
    const int first = tiled ? i / kernels::kLanes * kernels::kLanes : 0;
    for (int j = i; j < (tiled ? first + kernels::kLanes : stride_); ++j) {
      const double both = free[i] * free[j];
      double value = both * (inverse * from[static_cast<std::ptrdiff_t>(i) * stride_ + j]);
      if (i == j && free[i] == 0.0) value = 1.0;
      to[static_cast<std::ptrdiff_t>(i) * step + j - first] = value;
      to[static_cast<std::ptrdiff_t>(j) * step + i - first] = value;
    }
  }
}

void InteriorPointSolver::CopyCoupling(const ConvexSubproblem& problem, int t) {
  const int block = t + first_block_;
  // Many rows between blocks make it dense.
  const bool tiled = problem.coupling_is_tiled(block) && rows_.num_between(t) <= BlockChain::kMostRows;
  coupling_.push_back(NewSquare(tiled));
  chain_matrix_.SetCoupling(t, tiled, rows_.num_between(t));
  double* const to = Entries(coupling_.back());
  const double* const from = problem.coupling(block);
  const double* const free = free_.data() + static_cast<std::ptrdiff_t>(block) * stride_;
  const int width = tiled ? kernels::kLanes : stride_;
  const double inverse = 1.0 / scale_;
  for (int i = 0; i < stride_; ++i) {
    const int first = tiled ? i / kernels::kLanes * kernels::kLanes : 0;
    for (int j = 0; j < width; ++j) {
      const double both = free[i] * free[stride_ + first + j] * inverse;
      to[static_cast<std::ptrdiff_t>(i) * width + j] =
          both * from[static_cast<std::ptrdiff_t>(i) * stride_ + first + j];
    }
  }
}

/// Gradient += H x of the fixed variables.
void InteriorPointSolver::ShiftByFixed(const ConvexSubproblem& problem) {
  const int n = problem.block_size();
  const auto place = [&](int k) { return static_cast<size_t>(k / n * stride_ + k % n); };
  const size_t begin = static_cast<size_t>(first_block_) * static_cast<size_t>(stride_);
  const auto add = [&](size_t i, double change) {
    if (i >= begin && i < begin + num_x_) gradient_[i - begin] += change * free_[i] / scale_;
  };
  ForEachHessianEntry(problem, problem.has_coupling(), [&](int i, int j, double value) {
    add(place(i), value * fixed_[place(j)]);
    if (i != j) add(place(j), value * fixed_[place(i)]);
  });
}

void InteriorPointSolver::StartRow(size_t i, double a, double barrier) {
  const double half = 0.5 * (y_.upper[i] - y_.lower[i]);
  const double t =
      a * half /
      (barrier + std::sqrt(barrier * barrier + a * half * (a * half)));  // a = barrier (1/(uy - y) - 1/(y - ly))
  y_.value[i] = y_.lower[i] + half * (1.0 + t);
  y_.z_lower[i] = barrier / (half * (1.0 + t));
  y_.z_upper[i] = barrier / (half * (1.0 - t));
  if (t > 0.0) {  // the small one of the two is exact, the other follows from the residual
    y_.z_upper[i] = a + y_.z_lower[i];
  } else {
    y_.z_lower[i] = y_.z_upper[i] - a;
  }
}

void InteriorPointSolver::StartingPoint() {
  for (size_t i = 0; i < num_x_; ++i) {
    if (x_.free[i] == 0.0) continue;
    const double inset = kStartInset * (x_.upper[i] - x_.lower[i]);
    x_.value[i] = std::clamp(0.0, x_.lower[i] + inset, x_.upper[i] - inset);
  }
  std::fill(row_values_.begin(), row_values_.end(), 0.0);
  for (size_t i = 0; i < num_y_; ++i) row_values_[i] = rows_.offset(i);
  rows_.AddProducts(x_.value, row_values_);
  double mean = 0.0;
  for (size_t i = 0; i < num_y_; ++i) mean += std::abs(row_values_[i]) * y_.upper[i];
  if (num_y_ > 0) mean /= static_cast<double>(num_y_);
  const double barrier = std::max(kStartBarrier * mean, kMinStartBarrier);
  for (size_t i = 0; i < num_y_; ++i) StartRow(i, row_values_[i], barrier);

  // zl - zu must equal H x + g + A'y.
  UpdateSlope();
  std::copy(slope_.begin(), slope_.end(), x_.step.begin());
  rows_.AddTransposed(y_.value, x_.step);
  for (size_t i = 0; i < num_x_; ++i) {
    if (x_.free[i] == 0.0) continue;
    const double slack = 2.0 * barrier / (x_.upper[i] - x_.lower[i]);
    x_.z_lower[i] = std::max(x_.step[i], 0.0) + slack;
    x_.z_upper[i] = std::max(-x_.step[i], 0.0) + slack;
  }
  x_.Start();
  y_.Start();
}

void InteriorPointSolver::UpdateSlope() {
  std::copy(gradient_.begin(), gradient_.end(), slope_.begin());
  for (int t = 0; t < num_blocks_; ++t) {
    const double* x = Segment(x_.value, t);
    double* slope = Segment(slope_, t);
    const Square& square = hessian_[static_cast<size_t>(t)];
    if (square.tiled) {
      kernels::AddCombinationOfTiled(x, Entries(square), slope, stride_);
    } else {
      kernels::AddCombination(x, Entries(square), stride_, stride_, slope, stride_);
    }
    if (!coupled_costs_ || t + 1 == num_blocks_) continue;
    const Square& coupling = coupling_[static_cast<size_t>(t)];
    if (coupling.tiled) {
      kernels::AddProductsOfTiled(Entries(coupling), x + stride_, slope, stride_);
      kernels::AddCombinationOfTiled(x, Entries(coupling), slope + stride_, stride_);
    } else {
      kernels::AddProducts(Entries(coupling), stride_, stride_, x + stride_, slope, stride_);
      kernels::AddCombination(x, Entries(coupling), stride_, stride_, slope + stride_, stride_);
    }
  }
}

double InteriorPointSolver::Decrease() const {
  double linear = 0.0, quadratic = 0.0;
  for (size_t i = 0; i < num_x_; ++i) {
    linear += gradient_[i] * x_.value[i];
    quadratic += (slope_[i] - gradient_[i]) * x_.value[i];
  }
  double decrease = fixed_decrease_;
  for (size_t i = 0; i < num_y_; ++i) {
    const auto penalty = [&](double value) { return rows_.absolute(i) ? std::abs(value) : std::max(0.0, value); };
    decrease += rows_.weight(i) / scale_ * (penalty(rows_.offset(i)) - penalty(row_values_[i]));
  }
  return decrease - linear - 0.5 * quadratic;
}

bool InteriorPointSolver::IsSolved(const Accuracy& accuracy, double gap) const {
  if (gap <= std::max(accuracy.gap / scale_, kRelativeGap * static_cast<double>(num_products_))) return true;
  if (accuracy.share >= 1.0 && accuracy.negligible <= 0.0) return false;
  const double decrease = Decrease(), possible = decrease + gap;
  return possible * scale_ < accuracy.negligible || (accuracy.share < 1.0 && decrease >= accuracy.share * possible);
}

bool InteriorPointSolver::AffineDirection() {
  for (double pivot_floor = kMinPivot; pivot_floor <= kMaxPivotFloor; pivot_floor *= kPivotFloorGrowth) {
    if (Factor(pivot_floor) && CompleteSteps()) return true;
  }
  return false;
}

// (H + Theta + A'DA) dx = -(g + H x) - A'(y + D (A x + b)): the affine multipliers' steps cancel z - zu and w - wu.
bool InteriorPointSolver::Factor(double pivot_floor) {
  y_.BarrierHessian(weight_);
  for (size_t i = 0; i < weight_.size(); ++i) {
    weight_[i] = y_.free[i] / (weight_[i] + (1.0 - y_.free[i]));
    row_scratch_[i] = -(y_.value[i] + weight_[i] * row_values_[i]);
  }
  x_.BarrierHessian(theta_);
  for (size_t i = 0; i < num_x_; ++i) x_.step[i] = -x_.free[i] * slope_[i];
  rows_.AddTransposed(0, row_scratch_, x_.step);
  for (int t = 0; t < num_blocks_; ++t) {  // all of it while the block and its rows are in the cache
    FormBlock(t);
    const bool linked = chain_ && t + 1 < num_blocks_;
    if (linked) rows_.SetCouplingRows(t, weight_, chain_matrix_);
    const double* const coupling = linked ? Entries(coupling_[static_cast<size_t>(t)]) : nullptr;
    if (!chain_matrix_.Eliminate(t, coupling, pivot_floor)) return false;
    if (t + 1 < num_blocks_) rows_.AddTransposed(t + 1, row_scratch_, x_.step);
    chain_matrix_.SolveForward(t, x_.step);
  }
  std::copy(row_values_.begin(), row_values_.end(), y_.step.begin());
  return true;
}

/// Diagonal block t of H + Theta + A'DA.
void InteriorPointSolver::FormBlock(int t) {
  double* const block = chain_matrix_.block(t);
  const Square& square = hessian_[static_cast<size_t>(t)];
  if (square.tiled) {
    kernels::SpreadTilesUpper(Entries(square), block, stride_);
  } else {
    kernels::CopyUpper(Entries(square), block, stride_);
  }
  rows_.AddSquares(t, weight_, chain_matrix_);
  const double* theta = Segment(theta_, t);
  for (std::ptrdiff_t i = 0; i < stride_; ++i) block[i * stride_ + i] += theta[i];
}

// With the targets e of both (boxed_variables.h), (H + Theta + A'DA) dx = e - (g + H x) - A'(y + D (A x + b + e')).
bool InteriorPointSolver::CorrectedDirection(double sigma) {
  x_.Correct(sigma);
  y_.Correct(sigma);
  for (size_t i = 0; i < y_.size(); ++i) {
    y_.step[i] = row_values_[i] + y_.drive[i];
    row_scratch_[i] = -(y_.value[i] + weight_[i] * y_.step[i]);
  }
  for (size_t i = 0; i < num_x_; ++i) x_.step[i] = x_.drive[i] - x_.free[i] * slope_[i];
  rows_.AddTransposed(row_scratch_, x_.step);
  for (int t = 0; t < num_blocks_; ++t) chain_matrix_.SolveForward(t, x_.step);
  return CompleteSteps();
}

// dy = D (A dx + A x + b + e'), the last three of which y's step holds.
bool InteriorPointSolver::CompleteSteps() {
  chain_matrix_.SolveBack(x_.step);
  if (!kernels::AllFinite(x_.step.data(), static_cast<int>(num_x_))) return false;
  std::fill(row_steps_.begin(), row_steps_.end(), 0.0);
  rows_.AddProducts(x_.step, row_steps_);
  for (size_t i = 0; i < y_.size(); ++i) y_.step[i] = weight_[i] * (y_.step[i] + row_steps_[i]);
  return true;
}

void InteriorPointSolver::Move(double length) {
  x_.Move(length);
  y_.Move(length);
  for (size_t i = 0; i < y_.size(); ++i) row_values_[i] += length * row_steps_[i];
  UpdateSlope();
}

}  // namespace legopt

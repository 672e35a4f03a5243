#include "legopt/solvers/subproblem/interior_point.h"

#include <algorithm>
#include <cmath>

#include "legopt/solvers/subproblem/dense_kernels.h"

namespace legopt {
namespace {

using kernels::Lanes;
using kernels::Load;
using kernels::Store;

constexpr size_t kLanes = kernels::kLanes;

/// Ignores NaN candidates (0 / 0 of fixed variables).
Lanes Larger(Lanes candidate, Lanes best) { return candidate > best ? candidate : best; }

double Largest(Lanes v) { return std::max(std::max(v[0], v[1]), std::max(v[2], v[3])); }

}  // namespace

void BoxedVariables::Reset(size_t count) {
  const size_t padded = (count + kLanes - 1) / kLanes * kLanes;
  for (auto* v : {&value, &z_lower, &z_upper, &free, &step, &drive, &z_lower_step_, &z_upper_step_}) {
    v->assign(padded, 0.0);
  }
  lower.assign(padded, -1.0);
  upper.assign(padded, 1.0);
  below_.assign(padded, 1.0);
  above_.assign(padded, 1.0);
  inverse_below_.assign(padded, 1.0);
  inverse_above_.assign(padded, 1.0);
}

void BoxedVariables::SetFree(size_t i, double low, double high) {
  lower[i] = low;
  upper[i] = high;
  free[i] = 1.0;
}

void BoxedVariables::SetFixed(size_t i, double at) {
  value[i] = at;
  lower[i] = at - 1.0;  // any slack works
  upper[i] = at + 1.0;
}

void BoxedVariables::Start() {
  constexpr double kMinShare = 1e-15;  // relative to the box
  for (size_t i = 0; i < size(); ++i) {
    const double least = kMinShare * (upper[i] - lower[i]);
    below_[i] = std::max(value[i] - lower[i], least);
    above_[i] = std::max(upper[i] - value[i], least);
  }
  Move(0.0);
}

void BoxedVariables::UpdateGap() {
  Lanes lower_gap = {}, upper_gap = {};
  for (size_t i = 0; i < size(); i += kLanes) {
    lower_gap += Load(&z_lower[i]) * Load(&below_[i]);
    upper_gap += Load(&z_upper[i]) * Load(&above_[i]);
  }
  gap_ = kernels::Sum(lower_gap + upper_gap);
}

void BoxedVariables::BarrierHessian(AlignedDoubles& theta) const {
  theta.resize(size());
  for (size_t i = 0; i < size(); i += kLanes) {
    Store(&theta[i], Load(&z_lower[i]) * Load(&inverse_below_[i]) + Load(&z_upper[i]) * Load(&inverse_above_[i]));
  }
}

// -dz / z is 1 + r and 1 - q; the slacks shrink by -r and q, relatively.
double BoxedVariables::InverseMaxAffineStep() const {
  Lanes most = kernels::Broadcast(1.0);
  for (size_t i = 0; i < size(); i += kLanes) {
    const Lanes d = Load(&step[i]);
    const Lanes r = d * Load(&inverse_below_[i]), q = d * Load(&inverse_above_[i]);
    most = Larger(Larger(-r, 1.0 + r), most);
    most = Larger(Larger(q, 1.0 - q), most);
  }
  return Largest(most);
}

double BoxedVariables::GapAfterAffine(double length) const {
  Lanes lower_gap = {}, upper_gap = {};
  for (size_t i = 0; i < size(); i += kLanes) {
    const Lanes change = length * Load(&step[i]);
    const Lanes r = change * Load(&inverse_below_[i]), q = change * Load(&inverse_above_[i]);
    lower_gap += Load(&z_lower[i]) * ((1.0 - length) - r) * (Load(&below_[i]) + change);
    upper_gap += Load(&z_upper[i]) * ((1.0 - length) + q) * (Load(&above_[i]) - change);
  }
  return kernels::Sum(lower_gap + upper_gap);
}

void BoxedVariables::Correct(double sigma) {
  for (size_t i = 0; i < size(); i += kLanes) {
    const Lanes d = Load(&step[i]), below = Load(&inverse_below_[i]), above = Load(&inverse_above_[i]);
    const Lanes r = d * below, q = d * above;
    const Lanes e_lower = sigma * below + Load(&z_lower[i]) * r * (1.0 + r);
    const Lanes e_upper = sigma * above - Load(&z_upper[i]) * q * (1.0 - q);
    Store(&z_lower_step_[i], e_lower);
    Store(&z_upper_step_[i], e_upper);
    Store(&drive[i], e_lower - e_upper);
  }
}

double BoxedVariables::CompleteDirection() {
  Lanes most = kernels::Broadcast(1.0);
  for (size_t i = 0; i < size(); i += kLanes) {
    const Lanes d = Load(&step[i]);
    const Lanes r = d * Load(&inverse_below_[i]), q = d * Load(&inverse_above_[i]);
    const Lanes lower_z = Load(&z_lower[i]), upper_z = Load(&z_upper[i]);
    const Lanes lower_step = Load(&z_lower_step_[i]) - lower_z * (1.0 + r);
    const Lanes upper_step = Load(&z_upper_step_[i]) - upper_z * (1.0 - q);
    Store(&z_lower_step_[i], lower_step);
    Store(&z_upper_step_[i], upper_step);
    most = Larger(-r, most);
    most = Larger(q, most);
    most = Larger(-lower_step / lower_z, most);
    most = Larger(-upper_step / upper_z, most);
  }
  return Largest(most);
}

void BoxedVariables::Move(double length) {
  Lanes lower_gap = {}, upper_gap = {};
  for (size_t i = 0; i < size(); i += kLanes) {
    const Lanes change = length * Load(&step[i]), mask = Load(&free[i]);
    const Lanes below = Load(&below_[i]) + change, above = Load(&above_[i]) - change;
    const Lanes lower_z = Load(&z_lower[i]) + length * Load(&z_lower_step_[i]);
    const Lanes upper_z = Load(&z_upper[i]) + length * Load(&z_upper_step_[i]);
    lower_gap += lower_z * below;
    upper_gap += upper_z * above;
    Store(&value[i], Load(&value[i]) + change);
    Store(&below_[i], below);
    Store(&above_[i], above);
    Store(&z_lower[i], lower_z);
    Store(&z_upper[i], upper_z);
    Store(&inverse_below_[i], mask / below);
    Store(&inverse_above_[i], mask / above);
  }
  gap_ = kernels::Sum(lower_gap + upper_gap);
}

namespace {

constexpr int kMaxIterations = 60;
constexpr double kFixedWidth = 1e-14;  // bounds closer than this fix the variable
constexpr double kStepToBoundary = 0.995;
constexpr double kRelativeGap = 1e-12;       // relative to the scaled objective: the limit of double precision
constexpr double kMinPivot = 1e-14;          // relative to the diagonal before elimination
constexpr double kPivotFloorGrowth = 100.0;  // factor after a direction that was not finite
constexpr double kMaxPivotFloor = 1e-6;
constexpr double kStalledStep = 1e-8;
constexpr double kSingleShare = 2e-4;      // share of the first gap down to which single precision is good enough
constexpr double kSinglePivot = 5e-6;      // kMinPivot times the ratio of the two rounding errors
constexpr double kShortSingleStep = 0.01;  // a shorter step may be due to rounding errors
constexpr double kStartInset = 0.05;       // share of a box's width kept free at the initial point
constexpr double kStartBarrier = 0.5;      // relative to the mean row residual
constexpr double kMinStartBarrier = 1e-7;

}  // namespace

SubproblemSolver::Result InteriorPointSolver::Solve(const ConvexSubproblem& problem, const Accuracy& accuracy,
                                                    Eigen::Ref<Eigen::VectorXd> dx) {
  Prepare(problem);
  StartingPoint();
  const double first_gap = Gap();
  Result result;
  result.status = Status::kIterationLimit;
  for (; result.iterations < kMaxIterations; ++result.iterations) {
    bool solved = IsSolved(accuracy, Gap());
    if (single_precision_ && (solved || Gap() <= kSingleShare * first_gap)) {
      SwitchToDoublePrecision();
      solved = IsSolved(accuracy, Gap());
    }
    const double gap = Gap();
    if (!std::isfinite(gap)) {
      result.status = Status::kFailed;
      break;
    }
    if (solved) {
      result.status = Status::kSolved;
      break;
    }
    const double step = Iterate(gap);
    if (single_precision_) {
      if (step < kShortSingleStep) SwitchToDoublePrecision();
    } else if (step < kStalledStep) {
      break;
    }
  }
  if (single_precision_) SwitchToDoublePrecision();
  result.gap = Gap() * scale_;
  CopySolution(problem, dx);
  return result;
}

double InteriorPointSolver::Iterate(double gap) {
  if (!AffineDirection()) return 0.0;
  const double affine_step = 1.0 / std::max(x_.InverseMaxAffineStep(), y_.InverseMaxAffineStep());
  const double affine = (x_.GapAfterAffine(affine_step) + y_.GapAfterAffine(affine_step)) / gap;
  if (!CorrectedDirection(affine * affine * affine * gap / static_cast<double>(num_products_))) return 0.0;
  const double longest = 1.0 / std::max(x_.CompleteDirection(), y_.CompleteDirection());
  const double step = std::min(1.0, kStepToBoundary * longest);
  Move(step);
  return step;
}

void InteriorPointSolver::CopySolution(const ConvexSubproblem& problem, Eigen::Ref<Eigen::VectorXd> dx) const {
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
  FindFreeVariables(problem);
  const PackedRows::FreeVariables freedom = {free_, fixed_, shifted_, first_block_, first_block_ + num_blocks_};
  rows_.Pack(problem, freedom);
  costs_.Copy(problem, freedom, rows_, scale_);
  num_x_ = static_cast<size_t>(stride_) * static_cast<size_t>(num_blocks_);
  num_y_ = rows_.size();
  SetBoxes(problem);
  slope_.resize(num_x_);
  row_values_.resize(y_.size());
  row_steps_.assign(y_.size(), 0.0);
  row_scratch_.resize(y_.size());
  single_precision_ = true;
  single_matrix_.Reset(costs_, rows_);
}

/// Continues in double precision. Adds the rounding errors of both equations to the multipliers: the gap is exact from
/// here on.
void InteriorPointSolver::SwitchToDoublePrecision() {
  single_precision_ = false;
  double_matrix_begun_ = false;
  UpdateRows();
  for (size_t i = 0; i < num_y_; ++i) {
    const double missing = row_values_[i] - (y_.z_upper[i] - y_.z_lower[i]);
    (missing > 0.0 ? y_.z_upper : y_.z_lower)[i] += std::abs(missing);
  }
  std::copy(slope_.begin(), slope_.end(), x_.step.begin());
  AddTransposedRows(x_.step);
  for (size_t i = 0; i < num_x_; ++i) {
    if (x_.free[i] == 0.0) continue;
    const double missing = x_.step[i] - (x_.z_lower[i] - x_.z_upper[i]);
    (missing > 0.0 ? x_.z_lower : x_.z_upper)[i] += std::abs(missing);
  }
  x_.UpdateGap();
  y_.UpdateGap();
}

/// Finds the free variables, and the range from the first block with free variables to the last.
void InteriorPointSolver::FindFreeVariables(const ConvexSubproblem& problem) {
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
      x_.SetFixed(i, 0.0);  // its value is included in the gradient and the offsets
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

void InteriorPointSolver::StartRow(size_t i, double a, double barrier) {
  const double half = 0.5 * (y_.upper[i] - y_.lower[i]);
  const double t =
      a * half /
      (barrier + std::sqrt(barrier * barrier + a * half * (a * half)));  // a = barrier (1/(uy - y) - 1/(y - ly))
  y_.value[i] = y_.lower[i] + half * (1.0 + t);
  y_.z_lower[i] = barrier / (half * (1.0 + t));
  y_.z_upper[i] = barrier / (half * (1.0 - t));
  if (t > 0.0) {  // the smaller one is exact, the larger one follows from the residual
    y_.z_upper[i] = a + y_.z_lower[i];
  } else {
    y_.z_lower[i] = y_.z_upper[i] - a;
  }
}

void InteriorPointSolver::UpdateRows() {
  std::fill(row_values_.begin(), row_values_.end(), 0.0);
  for (size_t i = 0; i < num_y_; ++i) row_values_[i] = rows_.offset(i);
  rows_.AddProducts(rows_.coefficients().data(), x_.value, row_values_);
}

void InteriorPointSolver::AddTransposedRows(AlignedDoubles& sum) const {
  for (int t = 0; t < num_blocks_; ++t) {
    rows_.AddTransposed(t, rows_.coefficients().data(), y_.value.data(), sum);
  }
}

void InteriorPointSolver::StartingPoint() {
  for (size_t i = 0; i < num_x_; ++i) {
    if (x_.free[i] == 0.0) continue;
    const double inset = kStartInset * (x_.upper[i] - x_.lower[i]);
    x_.value[i] = std::clamp(0.0, x_.lower[i] + inset, x_.upper[i] - inset);
  }
  UpdateRows();
  double mean = 0.0;
  for (size_t i = 0; i < num_y_; ++i) mean += std::abs(row_values_[i]) * y_.upper[i];
  if (num_y_ > 0) mean /= static_cast<double>(num_y_);
  const double barrier = std::max(kStartBarrier * mean, kMinStartBarrier);
  for (size_t i = 0; i < num_y_; ++i) StartRow(i, row_values_[i], barrier);

  // zl - zu must equal H x + g + A'y.
  costs_.Slope(x_.value, slope_);
  std::copy(slope_.begin(), slope_.end(), x_.step.begin());
  AddTransposedRows(x_.step);
  for (size_t i = 0; i < num_x_; ++i) {
    if (x_.free[i] == 0.0) continue;
    const double slack = 2.0 * barrier / (x_.upper[i] - x_.lower[i]);
    x_.z_lower[i] = std::max(x_.step[i], 0.0) + slack;
    x_.z_upper[i] = std::max(-x_.step[i], 0.0) + slack;
  }
  x_.Start();
  y_.Start();
}

double InteriorPointSolver::Decrease() const {
  double linear = 0.0, quadratic = 0.0;
  for (size_t i = 0; i < num_x_; ++i) {
    linear += costs_.gradient()[i] * x_.value[i];
    quadratic += (slope_[i] - costs_.gradient()[i]) * x_.value[i];
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
  if (single_precision_) return Factor(single_matrix_, kSinglePivot) && CompleteSteps();
  if (!double_matrix_begun_) double_matrix_.Reset(costs_, rows_);
  double_matrix_begun_ = true;
  for (double pivot_floor = kMinPivot; pivot_floor <= kMaxPivotFloor; pivot_floor *= kPivotFloorGrowth) {
    if (Factor(double_matrix_, pivot_floor) && CompleteSteps()) return true;
  }
  return false;
}

// (H + Theta + A'DA) dx = -(g + H x) - A'(y + D (A x + b)): the affine multipliers' steps cancel z - zu and w - wu.
template <typename Real>
bool InteriorPointSolver::Factor(NewtonMatrix<Real>& matrix, double pivot_floor) {
  y_.BarrierHessian(weight_);
  for (size_t i = 0; i < weight_.size(); ++i) {
    weight_[i] = y_.free[i] / (weight_[i] + (1.0 - y_.free[i]));
    row_scratch_[i] = -(y_.value[i] + weight_[i] * row_values_[i]);
  }
  x_.BarrierHessian(theta_);
  for (size_t i = 0; i < num_x_; ++i) x_.step[i] = -x_.free[i] * slope_[i];
  matrix.SetWeights(weight_);
  matrix.BeginSolve(x_.step, row_scratch_);
  for (int t = 0; t < num_blocks_; ++t) {  // all steps while the block and its rows are in the cache
    if (!matrix.Eliminate(t, theta_, pivot_floor)) return false;
    matrix.SolveForward(t);
  }
  std::copy(row_values_.begin(), row_values_.end(), y_.step.begin());
  return true;
}

// With the targets e of x and e' of y (interior_point.h), the right-hand side is
// e - (g + H x) - A'(y + D (A x + b + e')).
bool InteriorPointSolver::CorrectedDirection(double sigma) {
  x_.Correct(sigma);
  y_.Correct(sigma);
  for (size_t i = 0; i < y_.size(); ++i) {
    y_.step[i] = row_values_[i] + y_.drive[i];
    row_scratch_[i] = -(y_.value[i] + weight_[i] * y_.step[i]);
  }
  for (size_t i = 0; i < num_x_; ++i) x_.step[i] = x_.drive[i] - x_.free[i] * slope_[i];
  const auto solve_forward = [&](auto& matrix) {
    matrix.BeginSolve(x_.step, row_scratch_);
    for (int t = 0; t < num_blocks_; ++t) matrix.SolveForward(t);
  };
  if (single_precision_) {
    solve_forward(single_matrix_);
  } else {
    solve_forward(double_matrix_);
  }
  return CompleteSteps();
}

// dy = D (A dx + A x + b + e'); y_.step holds the last three terms.
bool InteriorPointSolver::CompleteSteps() {
  if (single_precision_) {
    single_matrix_.SolveBack(x_.step, row_steps_);
  } else {
    double_matrix_.SolveBack(x_.step, row_steps_);
  }
  if (!kernels::AllFinite(x_.step.data(), static_cast<int>(num_x_))) return false;
  if (!kernels::AllFinite(row_steps_.data(), static_cast<int>(row_steps_.size()))) return false;
  for (size_t i = 0; i < y_.size(); ++i) y_.step[i] = weight_[i] * (y_.step[i] + row_steps_[i]);
  return true;
}

void InteriorPointSolver::Move(double length) {
  x_.Move(length);
  y_.Move(length);
  for (size_t i = 0; i < y_.size(); ++i) row_values_[i] += length * row_steps_[i];
  costs_.Slope(x_.value, slope_);
}

}  // namespace legopt

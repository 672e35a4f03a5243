#include "legopt/statics/internal/linear_program.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace legopt {
namespace {

constexpr double kCostTolerance = 1e-10;    // rates of the objective below this are 0
constexpr double kStepTolerance = 1e-12;    // violation of a bound that is accepted for a larger pivot
constexpr double kValueTolerance = 1e-11;   // violation of a bound that counts as none
constexpr double kSmallPivotShare = 1e-3;   // of the largest pivot that a step passes
constexpr int kPivotsWithoutProgress = 60;  // after which Bland's rule ends a cycle
constexpr int kMaxPivots = 5'000;
constexpr double kFullTurn = 2.0 * std::numbers::pi;
constexpr double kPivotTolerance = SimplexDictionary::kPivotTolerance;
// Phase 1 begins again if it found a feasible point only by the rounding of its pivots.
constexpr int kMaxRefinements = 3;

}  // namespace

double DualBound(const LinearProgram& program, const Eigen::VectorXd& c, const Eigen::VectorXd& y, double largest) {
  double bound = y.dot(program.b);
  for (Eigen::Index j = 0; j < c.size(); ++j) {
    bound += std::min(0.0, c[j] - y.dot(program.A.col(j))) * std::min(program.upper[j], largest);
  }
  for (Eigen::Index i = 0; i < y.size(); ++i) bound -= std::max(0.0, y[i]) * std::min(program.range[i], largest);
  return bound;
}

LinearProgramStatus LinearProgramSolver::Constrain(const LinearProgram& program) {
  dictionary_.Reset(program);
  dictionary_.Refactor();
  return FindFeasible();
}

LinearProgramStatus LinearProgramSolver::Resume(const LinearProgram& program) {
  if (!dictionary_.Replace(program)) return Constrain(program);
  const LinearProgramStatus status = FindFeasible();
  return status == LinearProgramStatus::kStalled ? Constrain(program) : status;
}

LinearProgramStatus LinearProgramSolver::FindFeasible() {
  pivots_ = 0;
  for (int refinement = 0; refinement < kMaxRefinements; ++refinement) {
    const double sum = SetViolationObjective();
    Refine();
    if (sum <= kFeasibilityTolerance) return LinearProgramStatus::kOptimal;
    if (dictionary_.IsOptimal(costs_, y_, kCostTolerance)) return LinearProgramStatus::kInfeasible;
    const std::optional<double> reduced = ReduceViolations(sum);
    if (!reduced) return LinearProgramStatus::kStalled;
    dictionary_.Refactor();
    if (*reduced > kFeasibilityTolerance) {
      SetViolationObjective();
      Refine();
      return LinearProgramStatus::kInfeasible;
    }
  }
  return LinearProgramStatus::kStalled;
}

std::optional<double> LinearProgramSolver::ReduceViolations(double sum) {
  dictionary_.BuildTable();
  int without_progress = 0;
  while (sum > 0.0) {
    dictionary_.SetObjective(0, costs_);
    const Eigen::Index column = EnteringColumn(without_progress > kPivotsWithoutProgress);
    if (column < 0) return sum;
    if (++pivots_ > kMaxPivots) return std::nullopt;
    const double direction = dictionary_.IsAtUpper(column) ? -1.0 : 1.0;
    const SimplexStep step = ViolationStep(column, direction);
    if (!std::isfinite(step.length)) return std::nullopt;  // all entries of the column are below the tolerance
    without_progress = step.length > kStepTolerance ? 0 : without_progress + 1;
    dictionary_.Move(column, direction, step);
    sum = SetViolationObjective();
  }
  return sum;
}

double LinearProgramSolver::SetViolationObjective() {
  costs_.setZero(dictionary_.rows() + dictionary_.columns());
  double sum = 0.0;
  for (Eigen::Index i = 0; i < dictionary_.rows(); ++i) {
    const double value = dictionary_.value(i), excess = value - dictionary_.UpperOfBasic(i);
    if (value < -kValueTolerance) {
      costs_[dictionary_.basic(i)] = -1.0;
      sum -= value;
    } else if (excess > kValueTolerance) {
      costs_[dictionary_.basic(i)] = 1.0;
      sum += excess;
    }
  }
  return sum;
}

LinearProgramStatus LinearProgramSolver::Minimize(const Eigen::VectorXd& c) {
  pivots_ = 0;
  costs_.setZero(dictionary_.rows() + dictionary_.columns());
  costs_.head(c.size()) = c;
  if (!dictionary_.has_table()) {
    Refine();
    if (dictionary_.IsOptimal(costs_, y_, kCostTolerance)) return LinearProgramStatus::kOptimal;
    dictionary_.BuildTable();
  }
  dictionary_.SetObjective(0, costs_);
  const LinearProgramStatus status = IterateFeasible();
  if (status != LinearProgramStatus::kOptimal) return status;
  dictionary_.Refactor();
  Refine();
  return status;
}

LinearProgramStatus LinearProgramSolver::IterateFeasible() {
  int without_progress = 0;
  while (pivots_ < kMaxPivots) {
    const Eigen::Index column = EnteringColumn(without_progress > kPivotsWithoutProgress);
    if (column < 0) return LinearProgramStatus::kOptimal;
    const double direction = dictionary_.IsAtUpper(column) ? -1.0 : 1.0;
    const SimplexStep step = FeasibleStep(column, direction);
    if (!std::isfinite(step.length)) return LinearProgramStatus::kUnbounded;
    without_progress = step.length > kStepTolerance ? 0 : without_progress + 1;
    dictionary_.Move(column, direction, step);
    ++pivots_;
  }
  return LinearProgramStatus::kStalled;
}

Eigen::Index LinearProgramSolver::EnteringColumn(bool first_index) const {
  Eigen::Index best = -1;
  double largest = kCostTolerance;
  for (Eigen::Index j = 0; j < dictionary_.columns(); ++j) {
    const double rate = dictionary_.rate(0, j);
    const double gain = dictionary_.IsAtUpper(j) ? rate : -rate;
    if (!(gain > largest) || !(dictionary_.UpperOfColumn(j) > 0.0)) continue;
    best = j;
    if (first_index) break;
    largest = gain;
  }
  return best;
}

/// The sum of the violations is convex along the step: its slope increases at each bound that a basic variable reaches.
SimplexStep LinearProgramSolver::ViolationStep(Eigen::Index column, double direction) {
  breakpoints_.clear();
  for (Eigen::Index i = 0; i < dictionary_.rows(); ++i) {
    const double rate = -direction * dictionary_.entry(i, column);
    if (std::abs(rate) < kPivotTolerance) continue;
    const double value = dictionary_.value(i), upper = dictionary_.UpperOfBasic(i);
    const double to_lower = -value / rate, to_upper = (upper - value) / rate;
    const bool below = value<-kValueTolerance, above = value> upper + kValueTolerance;
    if ((rate > 0.0 && below) || (rate < 0.0 && !below)) {
      breakpoints_.push_back({std::max(to_lower, 0.0), rate, static_cast<int>(i), false});
    }
    if (((rate < 0.0 && above) || (rate > 0.0 && !above)) && std::isfinite(upper)) {
      breakpoints_.push_back({std::max(to_upper, 0.0), rate, static_cast<int>(i), true});
    }
  }
  std::ranges::sort(breakpoints_, [](const Breakpoint& a, const Breakpoint& b) {
    return a.length != b.length ? a.length < b.length : std::abs(a.rate) > std::abs(b.rate);
  });
  const double width = dictionary_.UpperOfColumn(column);
  double slope = -std::abs(dictionary_.rate(0, column)), largest = 0.0;
  std::size_t passed = 0;
  while (passed < breakpoints_.size() && slope < 0.0 && breakpoints_[passed].length < width) {
    const double rate = std::abs(breakpoints_[passed++].rate);
    slope += rate;
    largest = std::max(largest, rate);
  }
  if (passed == 0 || (slope < 0.0 && std::isfinite(width))) return {.length = width};
  // The last one may be too small as a pivot; those before it improve the objective too.
  while (std::abs(breakpoints_[--passed].rate) < kSmallPivotShare * largest) {
  }
  const Breakpoint& last = breakpoints_[passed];
  return {.length = last.length, .row = last.row, .to_upper = last.to_upper};
}

/// Harris' ratio test: among the rows that bound the step, up to a tolerance, the one with the largest pivot.
SimplexStep LinearProgramSolver::FeasibleStep(Eigen::Index column, double direction) const {
  const auto limit = [&](Eigen::Index row, double slack) {
    const double rate = -direction * dictionary_.entry(row, column);
    // A value outside of its bounds by rounding allows no step; then the largest pivot decides.
    if (rate < -kPivotTolerance) return std::max((dictionary_.value(row) + slack) / -rate, 0.0);
    if (rate > kPivotTolerance) {
      return std::max((dictionary_.UpperOfBasic(row) - dictionary_.value(row) + slack) / rate, 0.0);
    }
    return kInfinity;
  };
  double bound = kInfinity;
  for (Eigen::Index i = 0; i < dictionary_.rows(); ++i) bound = std::min(bound, limit(i, kStepTolerance));
  if (dictionary_.UpperOfColumn(column) <= bound) return {.length = dictionary_.UpperOfColumn(column)};
  SimplexStep step{.length = kInfinity};
  double largest = 0.0;
  for (Eigen::Index i = 0; i < dictionary_.rows(); ++i) {
    const double pivot = std::abs(dictionary_.entry(i, column));
    if (!(pivot > largest) || limit(i, 0.0) > bound) continue;
    largest = pivot;
    step = {.length = limit(i, 0.0),
            .row = static_cast<int>(i),
            .to_upper = -direction * dictionary_.entry(i, column) > 0.0};
  }
  return step;
}

LinearProgramStatus LinearProgramSolver::Turn(const Eigen::VectorXd& c, const Eigen::VectorXd& d,
                                              const std::function<bool(const TurnedOptimum&)>& visit) {
  dictionary_.BuildTable();
  costs_.setZero(dictionary_.rows() + dictionary_.columns());
  costs_.head(c.size()) = c;
  dictionary_.SetObjective(0, costs_);
  costs_.head(d.size()) = d;
  dictionary_.SetObjective(1, costs_);
  double angle = 0.0;
  const auto goes_on = [&] {
    dictionary_.StoreSolution(&turned_x_);
    dictionary_.StoreTableMultipliers(&turned_y_);
    return visit({angle, turned_x_, turned_y_});
  };
  bool whole = !goes_on();
  for (pivots_ = 0; !whole && pivots_ < kMaxPivots; ++pivots_) {
    Eigen::Index column = -1;
    angle += TurnToNextColumn(&column);
    whole = angle >= kFullTurn;
    if (whole || column < 0) continue;
    const double direction = dictionary_.IsAtUpper(column) ? -1.0 : 1.0;
    const SimplexStep step = FeasibleStep(column, direction);
    if (!std::isfinite(step.length)) break;
    dictionary_.Move(column, direction, step);
    whole = step.length > kStepTolerance && !goes_on();
  }
  return whole ? LinearProgramStatus::kOptimal : LinearProgramStatus::kStalled;
}

double LinearProgramSolver::TurnToNextColumn(Eigen::Index* column) {
  *column = -1;
  double sine = 1.0, cosine = 0.0;  // a quarter turn
  for (Eigen::Index j = 0; j < dictionary_.columns(); ++j) {
    if (!(dictionary_.UpperOfColumn(j) > 0.0)) continue;
    const double sign = dictionary_.IsAtUpper(j) ? -1.0 : 1.0;
    const double here = std::max(0.0, sign * dictionary_.rate(0, j)), rate = sign * dictionary_.rate(1, j);
    // here cos + rate sin becomes negative after tan = here / -rate
    if (!(rate < -kCostTolerance) || !(here * cosine < -rate * sine)) continue;
    *column = j;
    const double norm = std::hypot(here, rate);
    sine = here / norm;
    cosine = -rate / norm;
  }
  Eigen::VectorXd& rates = dictionary_.rates(0);
  Eigen::VectorXd& turned = dictionary_.rates(1);
  for (Eigen::Index j = 0; j < dictionary_.columns(); ++j) {
    const double before = rates[j];
    rates[j] = cosine * before + sine * turned[j];
    turned[j] = cosine * turned[j] - sine * before;
  }
  return std::atan2(sine, cosine);
}

void LinearProgramSolver::Refine() {
  dictionary_.StoreSolution(&x_);
  dictionary_.StoreMultipliers(costs_, &y_);
  objective_ = costs_.head(dictionary_.columns()).dot(x_);
}

}  // namespace legopt

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
// The search begins again if numbers without the rounding of its pivots contradict its result.
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
  pivots_ = 0;
  dictionary_.Reset(program);
  dictionary_.Refactor();
  return FindFeasible();
}

LinearProgramStatus LinearProgramSolver::Resume(const LinearProgram& program) {
  if (!dictionary_.Replace(program)) return Constrain(program);
  pivots_ = 0;
  const LinearProgramStatus status = FindFeasible();
  return status == LinearProgramStatus::kStalled ? Constrain(program) : status;
}

LinearProgramStatus LinearProgramSolver::FindFeasible() {
  for (int refinement = 0; refinement <= kMaxRefinements; ++refinement) {
    const double sum = SetViolationObjective();
    if (!std::isfinite(sum) || !(dictionary_.residual() <= kFeasibilityTolerance)) break;
    if (sum <= kFeasibilityTolerance) {
      dictionary_.StoreSolution(&x_);
      return LinearProgramStatus::kOptimal;
    }
    Refine();
    if (dictionary_.IsOptimal(costs_, y_, kCostTolerance)) return LinearProgramStatus::kInfeasible;
    dictionary_.DropTable();
    if (!ReduceViolations(sum)) break;
    dictionary_.Refactor();
  }
  return LinearProgramStatus::kStalled;
}

bool LinearProgramSolver::ReduceViolations(double sum) {
  dictionary_.BuildTable();
  int without_progress = 0;
  while (sum > 0.0) {
    dictionary_.SetObjective(0, costs_);
    const PivotRule rule = RuleAfter(without_progress);
    const Eigen::Index column = EnteringColumn(rule);
    if (column < 0) return true;
    if (++pivots_ > kMaxPivots) return false;
    const double direction = dictionary_.IsAtUpper(column) ? -1.0 : 1.0;
    const SimplexStep step = ViolationStep(column, direction, rule);
    if (!std::isfinite(step.length)) return false;  // all entries of the column are below the tolerance
    without_progress = step.length > kStepTolerance ? 0 : without_progress + 1;
    dictionary_.Move(column, direction, step);
    sum = SetViolationObjective();
  }
  return true;
}

double LinearProgramSolver::SetViolationObjective() {
  costs_.setZero(dictionary_.rows() + dictionary_.columns());
  double sum = 0.0;
  for (Eigen::Index i = 0; i < dictionary_.rows(); ++i) {
    const double value = dictionary_.value(i), excess = value - dictionary_.UpperOfBasic(i);
    if (!(value >= -kValueTolerance)) {  // also NaN
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
  for (int refinement = 0; refinement <= kMaxRefinements; ++refinement) {
    if (FindFeasible() != LinearProgramStatus::kOptimal) break;
    SetCosts(c);
    Refine();
    if (!std::isfinite(objective_)) break;
    if (dictionary_.IsOptimal(costs_, y_, kCostTolerance)) return LinearProgramStatus::kOptimal;
    if (refinement > 0) dictionary_.DropTable();
    dictionary_.BuildTable();
    dictionary_.SetObjective(0, costs_);
    const LinearProgramStatus status = IterateFeasible();
    dictionary_.Refactor();
    if (status != LinearProgramStatus::kOptimal) return status;
  }
  return LinearProgramStatus::kStalled;
}

LinearProgramStatus LinearProgramSolver::IterateFeasible() {
  int without_progress = 0;
  while (pivots_ < kMaxPivots) {
    const PivotRule rule = RuleAfter(without_progress);
    const Eigen::Index column = EnteringColumn(rule);
    if (column < 0) return LinearProgramStatus::kOptimal;
    const double direction = dictionary_.IsAtUpper(column) ? -1.0 : 1.0;
    const SimplexStep step = FeasibleStep(column, direction, rule);
    if (!std::isfinite(step.length)) return LinearProgramStatus::kUnbounded;
    without_progress = step.length > kStepTolerance ? 0 : without_progress + 1;
    dictionary_.Move(column, direction, step);
    ++pivots_;
  }
  return LinearProgramStatus::kStalled;
}

LinearProgramSolver::PivotRule LinearProgramSolver::RuleAfter(int pivots_without_progress) {
  return pivots_without_progress > kPivotsWithoutProgress ? PivotRule::kBland : PivotRule::kDantzig;
}

Eigen::Index LinearProgramSolver::EnteringColumn(PivotRule rule) const {
  Eigen::Index best = -1;
  double largest = kCostTolerance;
  for (Eigen::Index j = 0; j < dictionary_.columns(); ++j) {
    const double rate = dictionary_.rate(0, j);
    const double gain = dictionary_.IsAtUpper(j) ? rate : -rate;
    if (!(gain > kCostTolerance) || !(dictionary_.UpperOfColumn(j) > 0.0)) continue;
    const bool is_better =
        rule == PivotRule::kDantzig ? gain > largest : best < 0 || dictionary_.nonbasic(j) < dictionary_.nonbasic(best);
    if (!is_better) continue;
    best = j;
    largest = gain;
  }
  return best;
}

void LinearProgramSolver::FindBreakpoints(Eigen::Index column, double direction) {
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
}

/// The sum of the violations is convex along the step: its slope increases at each bound that a basic variable reaches.
SimplexStep LinearProgramSolver::ViolationStep(Eigen::Index column, double direction, PivotRule rule) {
  FindBreakpoints(column, direction);
  const double width = dictionary_.UpperOfColumn(column);
  double slope = -std::abs(dictionary_.rate(0, column)), largest = 0.0;
  std::size_t passed = 0;
  while (passed < breakpoints_.size() && slope < 0.0 && breakpoints_[passed].length < width) {
    const double rate = std::abs(breakpoints_[passed++].rate);
    slope += rate;
    largest = std::max(largest, rate);
  }
  if (passed == 0 || (slope < 0.0 && std::isfinite(width))) return {.length = width};
  const auto is_large = [&](const Breakpoint& point) { return std::abs(point.rate) >= kSmallPivotShare * largest; };
  // The last one may be too small as a pivot; those before it improve the objective too.
  const Breakpoint* chosen = &breakpoints_[passed - 1];
  while (!is_large(*chosen)) --chosen;
  if (rule == PivotRule::kBland) {
    const double first = breakpoints_.front().length + kStepTolerance;
    for (const Breakpoint& point : breakpoints_) {
      if (point.length > first) break;
      const bool goes_first = chosen->length > first || dictionary_.basic(point.row) < dictionary_.basic(chosen->row);
      if (is_large(point) && goes_first) chosen = &point;
    }
  }
  return {.length = chosen->length, .row = chosen->row, .to_upper = chosen->to_upper};
}

/// Harris' ratio test: among the rows that bound the step, up to a tolerance, the one with the largest pivot. By
/// Bland's rule the one of the first variable whose pivot is not much smaller.
SimplexStep LinearProgramSolver::FeasibleStep(Eigen::Index column, double direction, PivotRule rule) const {
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
  if (!std::isfinite(bound)) return {.length = kInfinity};
  const auto pivot = [&](Eigen::Index row) { return std::abs(dictionary_.entry(row, column)); };
  Eigen::Index chosen = -1;
  for (Eigen::Index i = 0; i < dictionary_.rows(); ++i) {
    if (limit(i, 0.0) <= bound && (chosen < 0 || pivot(i) > pivot(chosen))) chosen = i;
  }
  if (rule == PivotRule::kBland) {
    const double least = kSmallPivotShare * pivot(chosen);
    for (Eigen::Index i = 0; i < dictionary_.rows(); ++i) {
      if (dictionary_.basic(i) < dictionary_.basic(chosen) && pivot(i) >= least && limit(i, 0.0) <= bound) chosen = i;
    }
  }
  return {.length = limit(chosen, 0.0),
          .row = static_cast<int>(chosen),
          .to_upper = -direction * dictionary_.entry(chosen, column) > 0.0};
}

LinearProgramStatus LinearProgramSolver::Turn(const Eigen::VectorXd& c, const Eigen::VectorXd& d,
                                              const std::function<bool(const TurnedOptimum&)>& visit) {
  dictionary_.BuildTable();
  SetCosts(c);
  dictionary_.SetObjective(0, costs_);
  SetCosts(d);
  dictionary_.SetObjective(1, costs_);
  double angle = 0.0;
  const auto goes_on = [&] {
    dictionary_.StoreSolution(&turned_x_);
    dictionary_.StoreTableMultipliers(&turned_y_);
    return visit({angle, turned_x_, turned_y_});
  };
  bool whole = !goes_on();
  int without_progress = 0;
  for (pivots_ = 0; !whole && pivots_ < kMaxPivots; ++pivots_) {
    const PivotRule rule = RuleAfter(without_progress);
    Eigen::Index column = -1;
    const double turn = TurnToNextColumn(rule, &column);
    angle += turn;
    whole = angle >= kFullTurn;
    if (whole || column < 0) continue;
    const double direction = dictionary_.IsAtUpper(column) ? -1.0 : 1.0;
    const SimplexStep step = FeasibleStep(column, direction, rule);
    if (!std::isfinite(step.length)) break;
    without_progress = step.length > kStepTolerance || turn > 0.0 ? 0 : without_progress + 1;
    dictionary_.Move(column, direction, step);
    whole = step.length > kStepTolerance && !goes_on();
  }
  dictionary_.Refactor();
  return whole ? LinearProgramStatus::kOptimal : LinearProgramStatus::kStalled;
}

double LinearProgramSolver::TurnToNextColumn(PivotRule rule, Eigen::Index* column) {
  *column = -1;
  double sine = 1.0, cosine = 0.0;  // a quarter turn
  for (Eigen::Index j = 0; j < dictionary_.columns(); ++j) {
    if (!(dictionary_.UpperOfColumn(j) > 0.0)) continue;
    const double sign = dictionary_.IsAtUpper(j) ? -1.0 : 1.0;
    const double here = std::max(0.0, sign * dictionary_.rate(0, j)), rate = sign * dictionary_.rate(1, j);
    // here cos + rate sin becomes negative after tan = here / -rate
    if (!(rate < -kCostTolerance)) continue;
    const double later = here * cosine + rate * sine;  // > 0 if after the column found so far
    const bool goes_first = rule == PivotRule::kBland && later == 0.0 && *column >= 0 &&
                            dictionary_.nonbasic(j) < dictionary_.nonbasic(*column);
    if (!(later < 0.0) && !goes_first) continue;
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

void LinearProgramSolver::SetCosts(const Eigen::VectorXd& c) {
  costs_.setZero(dictionary_.rows() + dictionary_.columns());
  costs_.head(c.size()) = c;
}

void LinearProgramSolver::Refine() {
  dictionary_.StoreSolution(&x_);
  dictionary_.StoreMultipliers(costs_, &y_);
  objective_ = costs_.head(dictionary_.columns()).dot(x_);
}

}  // namespace legopt

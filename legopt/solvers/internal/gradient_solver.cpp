#include "legopt/solvers/internal/gradient_solver.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace legopt {

void MomentDirection::Reset(const Program& program) {
  const Eigen::Index size = static_cast<Eigen::Index>(program.num_waypoints()) * program.tangent_size();
  first_.setZero(size);
  second_.setZero(size);
  beta1_power_ = beta2_power_ = 1.0;
}

void MomentDirection::Next(const Eigen::VectorXd& gradient, Eigen::VectorXd& direction) {
  const double beta1 = options_.beta1, beta2 = options_.beta2;
  first_ = beta1 * first_ + (1.0 - beta1) * gradient;
  second_ = beta2 * second_ + (1.0 - beta2) * gradient.cwiseAbs2();
  beta1_power_ *= beta1;
  beta2_power_ *= beta2;
  double of_first = 1.0 / (1.0 - beta1_power_), of_gradient = 0.0;
  if (nesterov_) {
    of_first = beta1 / (1.0 - beta1 * beta1_power_);
    of_gradient = (1.0 - beta1) / (1.0 - beta1_power_);
  }
  direction = (of_first * first_ + of_gradient * gradient).array() /
              ((second_ / (1.0 - beta2_power_)).array().sqrt() + options_.epsilon);
}

GradientSolver::GradientSolver(const GradientOptions& options, std::unique_ptr<GradientDirection> direction,
                               const Sampling& sampling)
    : PenaltySolver(options.penalty), options_(options), sampling_(sampling), direction_rule_(std::move(direction)) {}

void GradientSolver::Prepare(Program& program) {
  sampler_.Reset(program, sampling_);
  all_ = sampler_.All();
  objective_.Reset(program, options_.sharpness);
  line_.Reset(program, objective_);
  at_x_.Reset(program);
  memory_.Reset(program);
  models_.resize(program.terms().size());
  direction_.setZero(static_cast<Eigen::Index>(program.num_waypoints()) * program.tangent_size());
  zero_ = direction_;
}

void GradientSolver::Restart(Program& program) {
  objective_.set_penalty(penalty());
  direction_rule_->Reset(program);
  sampler_.Restart();
  filled_ = is_current_ = false;
  last_alpha_ = 0.0;
}

PenaltySolver::EpochEnd GradientSolver::Epoch(Program& program, Eigen::VectorXd& x) {
  const bool everything = sampler_.everything();
  EpochEnd end = EpochEnd::kStuck;
  for (int k = 0; k < sampler_.batches_per_epoch(); ++k) {
    if (!NextIteration()) return EpochEnd::kInterrupted;
    const TermMask& batch = everything ? all_ : sampler_.NextBatch(context().rng());
    if (!is_current_) LinearizeAt(program, x, batch);
    is_current_ = everything;  // otherwise the next batch has other terms
    line_.Aim(x, direction_, batch, remembers_terms() ? &models_ : nullptr);
    sampled_ = SampledGradient(program, batch);
    direction_rule_->Next(sampled_, direction_);
    const bool moved = Step(program, x);
    if (moved || direction_rule_->remembers() || !everything) end = EpochEnd::kDone;
  }
  Visit(x, everything ? exact_ : EvaluateObjective(program, x, scratch_));
  return end;
}

void GradientSolver::LinearizeAt(Program& program, const Eigen::VectorXd& x, const TermMask& batch) {
  if (remembers_terms() && !filled_) objective_.ValueAndGradients(x, all_, memory_, models_);
  filled_ = true;
  value_ = objective_.ValueAndGradients(x, batch, at_x_, models_);
  exact_ = objective_.exact();
  at_x_.Sum(program, batch, gradient_);
}

const Eigen::VectorXd& GradientSolver::SampledGradient(const Program& program, const TermMask& batch) {
  if (!remembers_terms()) return gradient_;
  for (size_t k = 0; k < batch.size(); ++k) {
    if (batch[k] != 0) memory_.of_term(k) = at_x_.of_term(k);
  }
  if (options_.memory == GradientMemory::kModels) {
    memory_sum_ = gradient_;
    objective_.ModelValue(models_, batch, zero_, memory_sum_);
  } else {
    memory_.Sum(program, all_, memory_sum_);
  }
  return memory_sum_;
}

bool GradientSolver::Step(const Program& program, Eigen::VectorXd& x) {
  const ValueAndSlope at_x = line_.Start(value_, gradient_);
  LineStart start;
  start.value = at_x.value;
  start.slope = at_x.slope;
  if (!std::isfinite(start.value) || !(start.slope < 0.0)) return false;
  start.first_alpha = last_alpha_ > 0.0 ? 2.0 * last_alpha_ : 1.0;
  start.max_alpha = line_.MaxAlpha(options_.line_search.max_step);
  const LineSearchResult found = SearchWolfe(line_, start, options_.line_search);
  const double alpha = found.wolfe ? found.alpha : LongerIfLower(found, start);
  if (alpha == 0.0) return false;
  const double reached = line_.alpha() == alpha ? line_.value() : line_.Value(alpha);
  if (!std::isfinite(reached)) return false;
  value_ = reached;  // if the batch has all terms, their value at the new x
  last_alpha_ = alpha;
  if (remembers_terms()) ShiftModels(program, line_.step(), models_);
  exact_ = objective_.exact();
  line_.SwapGradients(at_x_, gradient_);
  x = line_.point();
  return true;
}

double GradientSolver::LongerIfLower(const LineSearchResult& found, const LineStart& start) {
  const double short_alpha = std::min(line_.MaxAlpha(options_.line_search.short_step), start.max_alpha);
  if (!(short_alpha > found.alpha)) return found.alpha;
  const double lowest = found.alpha > 0.0 ? found.value : start.value;
  return line_.Value(short_alpha) < lowest ? short_alpha : found.alpha;
}

}  // namespace legopt

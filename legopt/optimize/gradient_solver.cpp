#include "legopt/optimize/gradient_solver.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace legopt {

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
  direction_.setZero(static_cast<Eigen::Index>(program.num_waypoints()) * program.tangent_size());
}

void GradientSolver::Restart(Program& program) {
  objective_.set_penalty(penalty());
  direction_rule_->Reset(program);
  sampler_.Restart();
  filled_ = looked_ = false;
  last_alpha_ = 0.0;
}

PenaltySolver::EpochEnd GradientSolver::Epoch(Program& program, Eigen::VectorXd& x) {
  EpochEnd end = EpochEnd::kStuck;
  for (int k = 0; k < sampler_.batches_per_epoch(); ++k) {
    if (!NextIteration()) return EpochEnd::kInterrupted;
    const TermMask& batch = sampler_.everything() ? all_ : sampler_.NextBatch(context().Draws());
    const TermMask& seen = searches_all() ? all_ : batch;
    if (!looked_) LookAt(program, x, seen);
    line_.Aim(x, direction_, seen);
    sampled_ = SampledGradient(program, batch);
    if (direction_rule_->couples()) line_.DropHeld(sampled_);
    direction_rule_->Next(sampled_, direction_);
    const bool moved = Step(x);
    if (moved || direction_rule_->remembers() || !sampler_.everything()) end = EpochEnd::kDone;
    looked_ = searches_all();
    if (!Visit(x, looked_ ? exact_ : EvaluateObjective(program, x, scratch_))) return EpochEnd::kDone;
  }
  return end;
}

void GradientSolver::LookAt(Program& program, const Eigen::VectorXd& x, const TermMask& mask) {
  value_ = objective_.Value(x, mask);
  exact_ = objective_.exact();
  objective_.Gradients(mask, at_x_);
  at_x_.Sum(program, mask, gradient_);
}

const Eigen::VectorXd& GradientSolver::SampledGradient(const Program& program, const TermMask& batch) {
  if (!sampling_.incremental) return gradient_;
  for (size_t k = 0; k < all_.size(); ++k) {
    if (!filled_ || batch[k] != 0) memory_.of_term(k) = at_x_.of_term(k);
  }
  filled_ = true;
  memory_.Sum(program, all_, memory_sum_);
  return memory_sum_;
}

bool GradientSolver::Step(Eigen::VectorXd& x) {
  LineStart start;
  start.value = value_;
  start.slope = line_.StartSlope(gradient_);
  if (!std::isfinite(start.value) || !(start.slope < 0.0)) return false;
  start.first_alpha = last_alpha_ > 0.0 ? 2.0 * last_alpha_ : 1.0;
  start.max_alpha = line_.MaxAlpha(options_.line_search.max_step);
  const LineSearchResult found = SearchWolfe(line_, start, options_.line_search);
  double alpha = found.alpha;
  if (!found.wolfe) alpha = std::max(alpha, line_.MaxAlpha(options_.line_search.short_step));
  if (alpha == 0.0) return false;
  const double reached = line_.alpha() == alpha ? found.value : line_.Value(alpha);
  if (!std::isfinite(reached)) return false;
  value_ = reached;
  last_alpha_ = alpha;
  exact_ = objective_.exact();
  line_.SwapGradients(at_x_, gradient_);
  x = line_.point();
  return true;
}

}  // namespace legopt

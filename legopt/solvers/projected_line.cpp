#include "legopt/solvers/projected_line.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace legopt {

void ProjectedLine::Reset(Program& program, SmoothObjective& objective) {
  program_ = &program;
  objective_ = &objective;
  const Eigen::Index tangent = static_cast<Eigen::Index>(program.num_waypoints()) * program.tangent_size();
  for (auto* v : {&lower_, &upper_, &step_, &gradient_, &others_}) v->setZero(tangent);
  point_.setZero(static_cast<Eigen::Index>(program.num_waypoints()) * program.point_size());
  term_gradients_.Reset(program);
}

void ProjectedLine::Aim(const Eigen::VectorXd& x, const Eigen::VectorXd& d, const TermMask& mask,
                        const TermModels* models) {
  x_ = &x;
  d_ = &d;
  mask_ = &mask;
  models_ = models;
  program_->StepBounds(x, lower_, upper_);
}

ValueAndSlope ProjectedLine::Start(double value, const Eigen::VectorXd& gradient) {
  step_.setZero();
  ValueAndSlope start{value + OthersValue(), 0.0};
  for (Eigen::Index j = 0; j < d_->size(); ++j) {
    const double direction = -(*d_)[j];
    if (!Held(j, direction)) start.slope += direction * (gradient[j] + others_[j]);
  }
  return start;
}

double ProjectedLine::OthersValue() {
  others_.setZero();
  return models_ == nullptr ? 0.0 : objective_->ModelValue(*models_, *mask_, step_, others_);
}

double ProjectedLine::MaxAlpha(double max_step) const {
  double largest = 0.0;
  for (Eigen::Index j = 0; j < d_->size(); ++j) {
    if (!Held(j, -(*d_)[j])) largest = std::max(largest, std::abs((*d_)[j]));
  }
  return largest > 0.0 ? max_step / largest : std::numeric_limits<double>::infinity();
}

double ProjectedLine::Value(double alpha) {
  alpha_ = alpha;
  has_gradient_ = false;
  step_ = (-alpha * *d_).cwiseMax(lower_).cwiseMin(upper_);
  program_->Retract(*x_, step_, point_);
  value_ = objective_->Value(point_, *mask_) + OthersValue();
  return value_;
}

void ProjectedLine::SwapGradients(TermGradients& of_terms, Eigen::VectorXd& sum) {
  if (!has_gradient_) Slope();
  std::swap(term_gradients_, of_terms);
  gradient_.swap(sum);
  has_gradient_ = false;
}

double ProjectedLine::Slope() {
  objective_->Gradients(*mask_, term_gradients_);
  term_gradients_.Sum(*program_, *mask_, gradient_);
  has_gradient_ = true;
  double slope = 0.0;
  for (Eigen::Index j = 0; j < d_->size(); ++j) {
    if (step_[j] > lower_[j] && step_[j] < upper_[j]) slope -= (*d_)[j] * (gradient_[j] + others_[j]);
  }
  return slope;
}

}  // namespace legopt

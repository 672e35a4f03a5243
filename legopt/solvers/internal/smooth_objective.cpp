#include "legopt/solvers/internal/smooth_objective.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace legopt {
namespace {

double Weight(const TermShape& shape, double penalty) {
  if (shape.kind == TermKind::kCost) return 1.0;
  return shape.kind == TermKind::kPreference ? shape.weight : penalty;
}

}  // namespace

void TermGradients::Reset(const Program& program) {
  const auto& terms = program.terms();
  by_term_.resize(terms.size());
  for (size_t k = 0; k < terms.size(); ++k) {
    by_term_[k].setZero(static_cast<Eigen::Index>(terms[k]->shape().num_waypoints) * program.tangent_size());
  }
}

void TermGradients::Sum(const Program& program, const TermMask& mask, Eigen::VectorXd& sum) const {
  sum.setZero(static_cast<Eigen::Index>(program.num_waypoints()) * program.tangent_size());
  for (size_t k = 0; k < by_term_.size(); ++k) {
    if (mask[k] == 0) continue;
    const Eigen::Index first = program.terms()[k]->shape().waypoint;
    sum.segment(first * program.tangent_size(), by_term_[k].size()) += by_term_[k];
  }
}

void SmoothObjective::Reset(Program& program, double sharpness) {
  program_ = &program;
  sharpness_ = sharpness;
}

double SmoothObjective::Value(Eigen::Ref<const Eigen::VectorXd> x, const TermMask& mask) {
  program_->SetPoint(x);
  exact_ = {};
  double sum = 0.0;
  const auto& terms = program_->terms();
  for (size_t k = 0; k < terms.size(); ++k) {
    if (mask[k] == 0) continue;
    residuals_.clear();
    terms[k]->Evaluate(residuals_);
    sum += AddShare(k);
  }
  return sum;
}

double SmoothObjective::ValueAndGradients(Eigen::Ref<const Eigen::VectorXd> x, const TermMask& mask,
                                          TermGradients& gradients, TermModels& models) {
  program_->SetPoint(x);
  exact_ = {};
  double sum = 0.0;
  for (size_t k = 0; k < mask.size(); ++k) {
    if (mask[k] == 0) continue;
    LinearizeTerm(k, models[k], gradients.of_term(k));
    residuals_.clear();
    for (int i = 0; i < models[k].rows(); ++i) residuals_.push_back(models[k].value(i));
    sum += AddShare(k);
  }
  return sum;
}

double SmoothObjective::AddShare(size_t k) {
  const TermShape& shape = program_->terms()[k]->shape();
  exact_.Add(shape, static_cast<int>(k), residuals_);
  double share = 0.0;
  for (const double r : residuals_) share += SmoothShare(shape.kind, r, sharpness_).value;
  return Weight(shape, penalty_) * share;
}

void SmoothObjective::Gradients(const TermMask& mask, TermGradients& gradients) {
  for (size_t k = 0; k < mask.size(); ++k) {
    if (mask[k] != 0) LinearizeTerm(k, model_, gradients.of_term(k));
  }
}

void SmoothObjective::LinearizeTerm(size_t k, LinearModel& model, Eigen::VectorXd& gradient) {
  Term& term = *program_->terms()[k];
  const Eigen::Index size = program_->tangent_size();
  const TermKind kind = term.shape().kind;
  const double weight = Weight(term.shape(), penalty_);
  gradient.setZero();
  term.Linearize(model);
  for (int i = 0; i < model.rows(); ++i) {
    const double slope = weight * SmoothShare(kind, model.value(i), sharpness_).slope;
    if (slope == 0.0) continue;
    for (int w = 0; w < model.num_waypoints(); ++w) {
      gradient.segment(w * size, size) += slope * Eigen::Map<const Eigen::VectorXd>(model.row(w, i), size);
    }
  }
}

double SmoothObjective::ModelValue(const TermModels& models, const TermMask& mask, const Eigen::VectorXd& dx,
                                   Eigen::VectorXd& gradient) const {
  const Eigen::Index size = program_->tangent_size();
  double sum = 0.0;
  for (size_t k = 0; k < models.size(); ++k) {
    if (mask[k] != 0) continue;
    const LinearModel& model = models[k];
    const TermShape& shape = program_->terms()[k]->shape();
    const double weight = Weight(shape, penalty_);
    const Eigen::Index first = shape.waypoint * size;
    for (int i = 0; i < model.rows(); ++i) {
      double residual = model.value(i);
      for (int w = 0; w < model.num_waypoints(); ++w) {
        residual += Eigen::Map<const Eigen::VectorXd>(model.row(w, i), size).dot(dx.segment(first + w * size, size));
      }
      const ValueAndSlope share = SmoothShare(shape.kind, residual, sharpness_);
      sum += weight * share.value;
      if (share.slope == 0.0) continue;
      for (int w = 0; w < model.num_waypoints(); ++w) {
        gradient.segment(first + w * size, size) +=
            weight * share.slope * Eigen::Map<const Eigen::VectorXd>(model.row(w, i), size);
      }
    }
  }
  return sum;
}

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

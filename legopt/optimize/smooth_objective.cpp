#include "legopt/optimize/smooth_objective.h"

#include <cmath>

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
    const TermShape& shape = terms[k]->shape();
    exact_.Add(shape, static_cast<int>(k), residuals_);
    double share = 0.0;
    for (const double r : residuals_) share += SmoothShare(shape.kind, r, sharpness_).value;
    sum += Weight(shape, penalty_) * share;
  }
  return sum;
}

void SmoothObjective::Gradients(const TermMask& mask, TermGradients& gradients) {
  const auto& terms = program_->terms();
  const Eigen::Index size = program_->tangent_size();
  for (size_t k = 0; k < terms.size(); ++k) {
    if (mask[k] == 0) continue;
    const TermKind kind = terms[k]->shape().kind;
    const double weight = Weight(terms[k]->shape(), penalty_);
    Eigen::VectorXd& gradient = gradients.of_term(k);
    gradient.setZero();
    terms[k]->Linearize(model_);
    for (int i = 0; i < model_.rows(); ++i) {
      const double slope = weight * SmoothShare(kind, model_.value(i), sharpness_).slope;
      if (slope == 0.0) continue;
      for (int w = 0; w < model_.num_waypoints(); ++w) {
        gradient.segment(w * size, size) += slope * Eigen::Map<const Eigen::VectorXd>(model_.row(w, i), size);
      }
    }
  }
}

}  // namespace legopt

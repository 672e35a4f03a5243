#include "legopt/problem/program.h"

#include <algorithm>
#include <utility>

namespace legopt {

void LinearModel::Reset(int rows, int tangent_size, int num_waypoints) {
  rows_ = rows;
  stride_ = PaddedSize(tangent_size);
  num_waypoints_ = num_waypoints;
  const auto count = static_cast<size_t>(rows);
  const size_t entries = count * static_cast<size_t>(stride_);
  if (value_.size() < count) value_.resize(count);
  std::fill_n(value_.begin(), count, 0.0);
  for (int k = 0; k < num_waypoints; ++k) {
    if (jacobian_[k].size() < entries) jacobian_[k].resize(entries);
    std::fill_n(jacobian_[k].begin(), entries, 0.0);
  }
}

void LinearModel::Shift(const double* dx, int tangent_size) {
  for (int k = 0; k < num_waypoints_; ++k) {
    for (int i = 0; i < rows_; ++i) {
      double sum = 0.0;
      for (int j = 0; j < tangent_size; ++j) sum += row(k, i)[j] * dx[k * tangent_size + j];
      value(i) += sum;
    }
  }
}

bool Term::RelaxMargin(double /*share*/) { return false; }

bool Term::SetDisabled(bool /*aside*/) { return false; }

void Term::RowKeys(int rows, std::vector<int>& keys) {
  for (int i = 0; i < rows; ++i) keys.push_back(i);
}

std::int64_t Program::TermEvaluations() const {
  std::int64_t sum = 0;
  for (const auto& term : terms()) sum += term->evaluations();
  return sum;
}

std::int64_t Program::TermWork_ns() const {
  std::int64_t sum = 0;
  for (const auto& term : terms()) sum += term->evaluations() * term->weight_ns();
  return sum;
}

void Program::PullBack(const double* /*dx*/, double* /*row*/) const {}

namespace {

TermShape OfOneWaypoint(TermShape shape) {
  shape.waypoint = 0;
  shape.num_waypoints = 1;
  return shape;
}

/// Term of the whole program as a term of the last waypoint that it touches. The original term counts the evaluations.
class ViewedTerm : public Term {
 public:
  ViewedTerm(Term& term, int tangent_size)
      : Term(OfOneWaypoint(term.shape())), term_(&term), tangent_size_(tangent_size) {}

  void RowKeys(int rows, std::vector<int>& keys) override { term_->RowKeys(rows, keys); }
  double AbsentRow() const override { return term_->AbsentRow(); }
  bool RelaxMargin(double share) override { return term_->RelaxMargin(share); }

 private:
  void ComputeResiduals(std::vector<double>& residuals) override { term_->Evaluate(residuals); }
  void ComputeModel(LinearModel& model) override {
    if (term_->shape().num_waypoints == 1) return term_->Linearize(model);
    term_->Linearize(of_both_);
    model.Reset(of_both_.rows(), tangent_size_, 1);
    for (int i = 0; i < of_both_.rows(); ++i) {
      model.value(i) = of_both_.value(i);
      std::copy_n(of_both_.row(1, i), tangent_size_, model.row(0, i));
    }
  }

  Term* term_;
  int tangent_size_;
  LinearModel of_both_;
};

bool IsConstraint(TermKind kind) { return kind == TermKind::kEquality || kind == TermKind::kInequality; }

}  // namespace

WaypointView::WaypointView(Program& whole, int waypoint, Eigen::Ref<const Eigen::VectorXd> x, ViewedTerms viewed)
    : whole_(&whole), waypoint_(waypoint), x_(x), next_(x) {
  const auto is_viewed = [=](const TermShape& shape) {
    if (shape.waypoint + shape.num_waypoints - 1 != waypoint) return false;
    return viewed == ViewedTerms::kUpToWaypoint || (shape.num_waypoints == 1 && IsConstraint(shape.kind));
  };
  for (const auto& term : whole.terms()) {
    if (is_viewed(term->shape())) terms_.push_back(std::make_unique<ViewedTerm>(*term, whole.tangent_size()));
  }
  const Eigen::Index tangents = static_cast<Eigen::Index>(whole.num_waypoints()) * whole.tangent_size();
  for (auto* vector : {&dx_, &lower_, &upper_}) vector->setZero(tangents);
}

void WaypointView::SetPoint(Eigen::Ref<const Eigen::VectorXd> x) {
  Part(x_, point_size()) = x;
  whole_->SetPoint(x_);
}

void WaypointView::Retract(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<const Eigen::VectorXd> dx,
                           Eigen::Ref<Eigen::VectorXd> x_next) const {
  Part(x_, point_size()) = x;
  Part(dx_, tangent_size()) = dx;
  whole_->Retract(x_, dx_, next_);
  x_next = Part(next_, point_size());
}

void WaypointView::StepBounds(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<Eigen::VectorXd> lower,
                              Eigen::Ref<Eigen::VectorXd> upper) const {
  Part(x_, point_size()) = x;
  whole_->StepBounds(x_, lower_, upper_);
  lower = Part(lower_, tangent_size());
  upper = Part(upper_, tangent_size());
}

void WaypointView::ProjectOnBounds(Eigen::Ref<Eigen::VectorXd> x) const {
  Part(x_, point_size()) = x;
  next_ = x_;
  whole_->ProjectOnBounds(next_);
  x = Part(next_, point_size());
}

bool WaypointView::IsFree() const {
  whole_->StepBounds(x_, lower_, upper_);
  return (Part(lower_, tangent_size()).array() < Part(upper_, tangent_size()).array()).any();
}

}  // namespace legopt

#include "legopt/optimize/equality_projection.h"

#include <Eigen/Cholesky>
#include <algorithm>

namespace legopt {

void EqualityProjection::Reset(const Program& program) {
  terms_.assign(static_cast<size_t>(program.num_waypoints()), {});
  for (size_t k = 0; k < program.terms().size(); ++k) {
    const TermShape& shape = program.terms()[k]->shape();
    if (shape.kind != TermKind::kEquality || shape.num_waypoints != 1) continue;
    terms_[static_cast<size_t>(shape.waypoint)].push_back(k);
  }
  jacobian_.resize(0, program.tangent_size());
  step_.setZero(program.tangent_size());
  free_.setZero(program.tangent_size());
}

void EqualityProjection::Project(Program& program, const Eigen::VectorXd& x, const Eigen::VectorXd& lower,
                                 const Eigen::VectorXd& upper, Eigen::VectorXd& dx, Eigen::VectorXd& point) {
  const Eigen::Index size = program.tangent_size();
  for (int k = 0; k < kMostSteps; ++k) {
    program.Retract(x, dx, point);
    program.SetPoint(point);
    bool moved = false;
    for (int t = 0; t < program.num_waypoints(); ++t) {
      if (terms_[static_cast<size_t>(t)].empty()) continue;
      const int rows = Stack(program, t, dx);
      moved = Correct(t * size, rows, lower, upper, dx) || moved;
    }
    if (!moved) return;
  }
  program.Retract(x, dx, point);
}

int EqualityProjection::Stack(const Program& program, int waypoint, const Eigen::VectorXd& dx) {
  const Eigen::Index size = program.tangent_size();
  int rows = 0;
  for (const size_t k : terms_[static_cast<size_t>(waypoint)]) {
    program.terms()[k]->Linearize(model_);
    const int needed = rows + model_.rows();
    if (needed > jacobian_.rows()) {
      jacobian_.conservativeResize(needed, size);
      residuals_.conservativeResize(needed);
    }
    for (int i = 0; i < model_.rows(); ++i, ++rows) {
      residuals_[rows] = model_.value(i);
      jacobian_.row(rows) = Eigen::Map<const Eigen::RowVectorXd>(model_.row(0, i), size);
      program.PullBack(dx.data() + waypoint * size, jacobian_.row(rows).data());
    }
  }
  return rows;
}

bool EqualityProjection::Correct(Eigen::Index first, int rows, const Eigen::VectorXd& lower,
                                 const Eigen::VectorXd& upper, Eigen::VectorXd& dx) {
  const auto r = residuals_.head(rows);
  if (!r.allFinite() || !jacobian_.topRows(rows).allFinite() || r.cwiseAbs().maxCoeff() < kHolds) return false;
  auto here = dx.segment(first, step_.size());
  const auto low = lower.segment(first, step_.size()), high = upper.segment(first, step_.size());
  free_ = (high.array() > low.array()).cast<double>();
  SolveStep(rows);
  // Variables that this would carry out of their bounds stay, and the others do their part.
  free_ = (free_.array() > 0.0 && (here + step_).array() >= low.array() && (here + step_).array() <= high.array())
              .cast<double>();
  SolveStep(rows);
  const double longest = step_.cwiseAbs().maxCoeff();
  if (!(longest > 0.0)) return false;
  here = (here + std::min(1.0, kLongest / longest) * step_).cwiseMax(low).cwiseMin(high);
  return true;
}

void EqualityProjection::SolveStep(int rows) {
  const auto count = static_cast<size_t>(rows);
  if (gram_.size() < count * count) gram_.resize(count * count);
  if (multipliers_.size() < rows) multipliers_.resize(rows);
  Eigen::Map<Eigen::MatrixXd> gram(gram_.data(), rows, rows);
  auto multipliers = multipliers_.head(rows);
  const auto jacobian = jacobian_.topRows(rows);
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j <= i; ++j) {
      gram(i, j) = (jacobian.row(i).transpose().cwiseProduct(free_)).dot(jacobian.row(j).transpose());
    }
  }
  const double largest = gram.diagonal().maxCoeff();
  if (!(largest > 0.0)) {
    step_.setZero();
    return;
  }
  gram.diagonal().array() += kDamping * largest;
  Eigen::Ref<Eigen::MatrixXd> in_place(gram);
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(in_place);
  multipliers = residuals_.head(rows);
  factor.solveInPlace(multipliers);
  step_.noalias() = -(jacobian.transpose() * multipliers);
  step_.array() *= free_.array();
}

}  // namespace legopt

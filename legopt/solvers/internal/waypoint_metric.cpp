#include "legopt/solvers/internal/waypoint_metric.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace legopt {
namespace {

/// Returns K, one row per difference.
Eigen::MatrixXd DifferencesOf(int num_waypoints, Differences differences) {
  const bool velocities = differences == Differences::kVelocities;
  const int width = velocities ? 2 : 3;
  const int rows = std::max(num_waypoints - width + 1, 0);
  Eigen::MatrixXd k = Eigen::MatrixXd::Zero(rows, num_waypoints);
  for (int t = 0; t < rows; ++t) {
    if (velocities) {
      k.row(t).segment(t, width) << -1.0, 1.0;
    } else {
      k.row(t).segment(t, width) << 1.0, -2.0, 1.0;
    }
  }
  return k;
}

}  // namespace

bool FirstWaypointIsFixed(const Program& program) {
  const Eigen::Index chain = program.num_waypoints(), size = program.tangent_size();
  if (chain < 2) return false;
  // Fixed variables are the same at every point.
  const Eigen::VectorXd anywhere = Eigen::VectorXd::Zero(chain * program.point_size());
  Eigen::VectorXd lower(chain * size), upper(chain * size);
  program.StepBounds(anywhere, lower, upper);
  return lower.head(size) == upper.head(size);
}

void WaypointMetric::Reset(int num_waypoints, int block_size, double smoothness, Differences differences,
                           bool first_fixed) {
  num_waypoints_ = num_waypoints;
  block_size_ = block_size;
  product_.resize(block_size, num_waypoints);
  for (auto* factor : {&inverse_, &root_, &smoother_}) factor->setZero(num_waypoints, num_waypoints);
  const int free = num_waypoints - (first_fixed ? 1 : 0);
  if (free == 0) return;
  const Eigen::MatrixXd k = DifferencesOf(num_waypoints, differences);
  const Eigen::MatrixXd metric =
      Eigen::MatrixXd::Identity(num_waypoints, num_waypoints) + smoothness * k.transpose() * k;
  const Eigen::LLT<Eigen::MatrixXd> factors(metric.bottomRightCorner(free, free));
  const Eigen::MatrixXd root = factors.matrixL().solve(Eigen::MatrixXd::Identity(free, free));
  const Eigen::MatrixXd inverse = root.transpose() * root;
  inverse_.bottomRightCorner(free, free) = inverse;
  root_.bottomRightCorner(free, free) = root / std::sqrt(inverse.diagonal().maxCoeff());
  for (int s = 0; s < free; ++s) {
    const auto column = inverse.col(s);
    smoother_.bottomRightCorner(free, free).row(s) = column.transpose() / (free * column.cwiseAbs().maxCoeff());
  }
}

void WaypointMetric::Multiply(const Eigen::MatrixXd& factor, Eigen::VectorXd& v) {
  // Column t of the map is waypoint t; row j is one variable along the chain, multiplied from the right.
  Eigen::Map<Eigen::MatrixXd> chain(v.data(), block_size_, num_waypoints_);
  product_.noalias() = chain * factor;
  chain = product_;
}

void EqualityProjection::Reset(const Program& program) {
  terms_.assign(static_cast<size_t>(program.num_waypoints()), {});
  for (size_t k = 0; k < program.terms().size(); ++k) {
    const TermShape& shape = program.terms()[k]->shape();
    if (Holds(shape)) terms_[static_cast<size_t>(shape.waypoint)].push_back(k);
  }
  jacobian_.resize(0, program.tangent_size());
  step_.setZero(program.tangent_size());
  free_.setZero(program.tangent_size());
}

void EqualityProjection::Linearize(Program& program, const Eigen::VectorXd& x, const Eigen::VectorXd& lower,
                                   const Eigen::VectorXd& upper, WaypointMetric& metric) {
  const Eigen::Index size = program.tangent_size();
  program.SetPoint(x);
  correction_.setZero(x.size() == 0 ? 0 : program.num_waypoints() * size);
  waypoint_of_.clear();
  for (Eigen::Index t = 0; t < program.num_waypoints(); ++t) {
    const int rows = terms_[static_cast<size_t>(t)].empty() ? 0 : Stack(program, static_cast<int>(t), nullptr);
    const auto first = static_cast<Eigen::Index>(waypoint_of_.size());
    if (chain_.rows() < first + rows) chain_.conservativeResize(first + rows, size);
    free_ = (upper.segment(t * size, size).array() > lower.segment(t * size, size).array()).cast<double>();
    for (int i = 0; i < rows; ++i) {
      chain_.row(first + i) = jacobian_.row(i).cwiseProduct(free_.transpose());
      waypoint_of_.push_back(t);
    }
  }
  metric_ = FactorChain(metric) ? &metric : nullptr;
}

bool EqualityProjection::FactorChain(const WaypointMetric& metric) {
  const auto rows = static_cast<Eigen::Index>(waypoint_of_.size());
  const size_t needed = waypoint_of_.size() * waypoint_of_.size();
  if (chain_gram_.size() < needed) chain_gram_.resize(needed);
  if (chain_multipliers_.size() < rows) chain_multipliers_.resize(rows);
  Eigen::Map<Eigen::MatrixXd> gram(chain_gram_.data(), rows, rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      const double coupling =
          metric.Inverse(waypoint_of_[static_cast<size_t>(i)], waypoint_of_[static_cast<size_t>(j)]);
      gram(i, j) = coupling * chain_.row(i).dot(chain_.row(j));
    }
  }
  return Factor(gram);
}

void EqualityProjection::MakeTangent(Eigen::VectorXd& v) {
  if (metric_ == nullptr) return;
  const auto rows = static_cast<Eigen::Index>(waypoint_of_.size());
  const Eigen::Index size = chain_.cols();
  auto multipliers = chain_multipliers_.head(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    multipliers[i] = chain_.row(i).dot(v.segment(waypoint_of_[static_cast<size_t>(i)] * size, size));
  }
  const Eigen::Map<const Eigen::MatrixXd> gram(chain_gram_.data(), rows, rows);
  gram.triangularView<Eigen::Lower>().solveInPlace(multipliers);
  gram.transpose().triangularView<Eigen::Upper>().solveInPlace(multipliers);
  correction_.setZero();
  for (Eigen::Index i = 0; i < rows; ++i) {
    correction_.segment(waypoint_of_[static_cast<size_t>(i)] * size, size) +=
        multipliers[i] * chain_.row(i).transpose();
  }
  metric_->ApplyInverse(correction_);
  v -= correction_;
}

void EqualityProjection::Project(Program& program, const Eigen::VectorXd& x, const Eigen::VectorXd& lower,
                                 const Eigen::VectorXd& upper, Eigen::VectorXd& dx, Eigen::VectorXd& point) {
  const Eigen::Index size = program.tangent_size();
  for (int k = 0; k < kMaxSteps; ++k) {
    program.Retract(x, dx, point);
    program.SetPoint(point);
    bool moved = false;
    for (int t = 0; t < program.num_waypoints(); ++t) {
      if (terms_[static_cast<size_t>(t)].empty()) continue;
      const int rows = Stack(program, t, &dx);
      moved = Correct(t * size, rows, lower, upper, dx) || moved;
    }
    if (!moved) return;
  }
  program.Retract(x, dx, point);
}

int EqualityProjection::Stack(const Program& program, int waypoint, const Eigen::VectorXd* dx) {
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
      if (dx != nullptr) program.PullBack(dx->data() + waypoint * size, jacobian_.row(rows).data());
    }
  }
  return rows;
}

bool EqualityProjection::Correct(Eigen::Index first, int rows, const Eigen::VectorXd& lower,
                                 const Eigen::VectorXd& upper, Eigen::VectorXd& dx) {
  const auto r = residuals_.head(rows);
  if (!r.allFinite() || !jacobian_.topRows(rows).allFinite() || r.cwiseAbs().maxCoeff() < kProjectionTolerance)
    return false;
  auto here = dx.segment(first, step_.size());
  const auto low = lower.segment(first, step_.size()), high = upper.segment(first, step_.size());
  free_ = (high.array() > low.array()).cast<double>();
  SolveStep(rows);
  // Fix the variables that the step moves out of their bounds, and solve again for the others.
  free_ = (free_.array() > 0.0 && (here + step_).array() >= low.array() && (here + step_).array() <= high.array())
              .cast<double>();
  SolveStep(rows);
  const double longest = step_.cwiseAbs().maxCoeff();
  if (!(longest > 0.0)) return false;
  here = (here + std::min(1.0, kLongest / longest) * step_).cwiseMax(low).cwiseMin(high);
  return true;
}

bool EqualityProjection::Factor(Eigen::Map<Eigen::MatrixXd>& gram) {
  if (gram.rows() == 0) return false;
  const double largest = gram.diagonal().maxCoeff();
  if (!(largest > 0.0) || !std::isfinite(largest)) return false;
  gram.diagonal().array() += kDamping * largest;
  Eigen::Ref<Eigen::MatrixXd> in_place(gram);
  return Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>>(in_place).info() == Eigen::Success;
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
  if (!Factor(gram)) {
    step_.setZero();
    return;
  }
  multipliers = residuals_.head(rows);
  gram.triangularView<Eigen::Lower>().solveInPlace(multipliers);
  gram.transpose().triangularView<Eigen::Upper>().solveInPlace(multipliers);
  step_.noalias() = jacobian.transpose() * multipliers;  // negating it here would need a temporary
  step_.array() *= -free_.array();
}

}  // namespace legopt

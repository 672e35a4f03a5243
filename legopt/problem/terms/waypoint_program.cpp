#include "legopt/problem/terms/waypoint_program.h"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "legopt/dataset/support_polygon.h"
#include "legopt/problem/terms/waypoint_terms.h"

namespace legopt {

WaypointProgram::WaypointProgram(const Dataset& dataset, CollisionQuery& query,
                                 std::span<const WaypointConstraints> demands, const ProximityOptions& proximity)
    : dataset_(&dataset), robot_(&dataset.robot()) {
  for (const WaypointConstraints& demand : demands) {
    stances_.push_back(demand.stance != nullptr ? *demand.stance : Stance{});
    states_.emplace_back(*robot_, query, proximity.range_m);
    fixed_.push_back(demand.fixed);
    if (demand.stance != nullptr) AddConstraints(dataset, demand, num_waypoints() - 1, proximity);
  }
}

void WaypointProgram::AddConstraints(const Dataset& dataset, const WaypointConstraints& demand, int waypoint,
                                     const ProximityOptions& proximity) {
  WaypointState& state = states_.back();
  const Stance& stance = *demand.stance;
  ContactPoseTerm::Weights weights;
  double margin_m = proximity.margin_m;
  if (demand.fixed) {  // a fixed waypoint only has to be valid
    weights.kept = weights.spent;
    margin_m = proximity.relaxed_margin_m;
  } else if (demand.on_segment) {
    weights.spent = weights.kept;
  }
  for (const ContactTarget& target : stance.contacts) {
    terms_.push_back(std::make_unique<ContactPoseTerm>(waypoint, state, dataset.contact(target.contact).link_index,
                                                       dataset.LinkTarget(target), target.contact, weights));
  }
  if (demand.balanced) {
    terms_.push_back(std::make_unique<ComTerm>(waypoint, state, Edges(TargetSupportPolygon(dataset, stance))));
  }
  terms_.push_back(std::make_unique<CollisionTerm>(waypoint, state, margin_m, proximity.relaxed_margin_m));
}

void WaypointProgram::SetPoint(Eigen::Ref<const Eigen::VectorXd> x) {
  const Eigen::Index size = point_size();
  for (size_t t = 0; t < states_.size(); ++t) states_[t].Update(x.segment(static_cast<Eigen::Index>(t) * size, size));
}

void WaypointProgram::Retract(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<const Eigen::VectorXd> dx,
                              Eigen::Ref<Eigen::VectorXd> x_next) const {
  const Eigen::Index points = point_size();
  const Eigen::Index tangents = tangent_size();
  for (Eigen::Index t = 0; t < num_waypoints(); ++t) {
    if (IsFixed(t)) {
      x_next.segment(t * points, points) = x.segment(t * points, points);
    } else {
      legopt::Retract(x.segment(t * points, points), dx.segment(t * tangents, tangents),
                      x_next.segment(t * points, points));
    }
  }
  ProjectOnBounds(x_next);
}

void WaypointProgram::PullBack(const double* dx, double* row) const {
  constexpr double kSmallAngle = 1e-4;  // below it, the next terms of the series are at most about 1e-16
  const Eigen::Index base = robot_->base_rotation_index();
  const Eigen::Map<const Eigen::Vector3d> phi(dx + base);
  Eigen::Map<Eigen::Vector3d> g(row + base);
  const double angle = phi.norm();
  double first = 0.5;       // (1 - cos angle) / angle^2
  double second = 1.0 / 6;  // (angle - sin angle) / angle^3
  if (angle >= kSmallAngle) {
    first = (1.0 - std::cos(angle)) / (angle * angle);
    second = (angle - std::sin(angle)) / (angle * angle * angle);
  }
  // J^T g with J = I + first [phi]x + second [phi]x^2; the transpose changes the sign of the odd term.
  const Eigen::Vector3d across = phi.cross(g);
  g += second * phi.cross(across) - first * across;
}

void WaypointProgram::StepBounds(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<Eigen::VectorXd> lower,
                                 Eigen::Ref<Eigen::VectorXd> upper) const {
  const Eigen::Index n = robot_->num_dofs();
  lower.setConstant(-std::numeric_limits<double>::infinity());
  upper.setConstant(std::numeric_limits<double>::infinity());
  for (Eigen::Index t = 0; t < num_waypoints(); ++t) {
    if (IsFixed(t)) {
      lower.segment(t * tangent_size(), tangent_size()).setZero();
      upper.segment(t * tangent_size(), tangent_size()).setZero();
      continue;
    }
    const auto joints = x.segment(t * point_size(), n);
    lower.segment(t * tangent_size(), n) = robot_->lower_limits() - joints;
    upper.segment(t * tangent_size(), n) = robot_->upper_limits() - joints;
  }
}

void WaypointProgram::ProjectOnBounds(Eigen::Ref<Eigen::VectorXd> x) const {
  const Eigen::Index n = robot_->num_dofs();
  for (Eigen::Index t = 0; t < num_waypoints(); ++t) {
    if (IsFixed(t)) continue;
    auto joints = x.segment(t * point_size(), n);
    joints = joints.cwiseMax(robot_->lower_limits()).cwiseMin(robot_->upper_limits());
  }
}

}  // namespace legopt

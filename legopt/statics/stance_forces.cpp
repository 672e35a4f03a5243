#include "legopt/statics/stance_forces.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "legopt/dataset/contact.h"

namespace legopt {
namespace {

/// Returns where the contact's points are when it is at its target, `slide_m` along its bar.
std::vector<Eigen::Vector3d> PointsAtTarget(const Contact& contact, const ContactTarget& target, double slide_m) {
  if (contact.facts().shape == ContactShape::kBall) {
    return {contact.OriginTarget(target) - contact.radius_m * NormalOf(target)};
  }
  const Eigen::Isometry3d X_WL = contact.LinkTarget(target);
  const Eigen::Vector3d shift_W = slide_m * (target.rotation.normalized() * Eigen::Vector3d::UnitX());
  std::vector<Eigen::Vector3d> points_W;
  points_W.reserve(contact.points_L.size());
  for (const Eigen::Vector3d& point_L : contact.points_L) points_W.emplace_back(X_WL * point_L + shift_W);
  return points_W;
}

/// Returns how far a posture grips a bar from its target.
double SlideAt(const Contact& contact, const ContactTarget& target, const Kinematics& kinematics) {
  const double largest_m = contact.SlideOf(target);
  if (largest_m == 0.0) return 0.0;
  const Eigen::Vector3d origin_W = kinematics.link_pose(contact.link_index) * contact.X_LC.translation();
  const Eigen::Vector3d bar_W = target.rotation.normalized() * Eigen::Vector3d::UnitX();
  return std::clamp(bar_W.dot(origin_W - contact.OriginTarget(target)), -largest_m, largest_m);
}

/// Upper bound of the distance of the centre of mass from any of the contact's points, m.
double ComReachOf(const Contact& contact, const ContactTarget& target) {
  double extent_m = 0.0;
  for (const Eigen::Vector3d& point_L : contact.points_L) {
    extent_m = std::max(extent_m, (point_L - contact.X_LC.translation()).norm());
  }
  return contact.com_reach_m + extent_m + contact.radius_m + contact.SlideOf(target);
}

/// Generators of the forces at one point of a surface, 3 x L.
Eigen::Matrix3Xd DirectionsOf(const TouchedSurface& surface, double widening) {
  Eigen::Matrix3Xd directions;
  if (surface.max_component) {
    directions.resize(3, 6);
    directions << surface.axes_W, -surface.axes_W;
    return directions;
  }
  directions.resize(3, kPyramidEdges);
  for (int edge = 0; edge < kPyramidEdges; ++edge) {
    const double angle = 2.0 * std::numbers::pi * edge / kPyramidEdges;
    const Eigen::Vector3d tangent = std::cos(angle) * surface.axes_W.col(0) + std::sin(angle) * surface.axes_W.col(1);
    directions.col(edge) = surface.axes_W.col(2) + widening * surface.friction * tangent;
  }
  return directions;
}

}  // namespace

std::vector<TouchedSurface> SurfacesOf(const Dataset& dataset, const Stance& stance, const Kinematics* kinematics) {
  const double weight_N = dataset.robot().total_mass() * dataset.gravity_m_s2();
  std::vector<TouchedSurface> surfaces;
  for (const ContactTarget& target : stance.contacts) {
    if (!target.carries) continue;
    const Contact& contact = dataset.contact(target.contact);
    TouchedSurface& surface = surfaces.emplace_back();
    surface.link = contact.link_index;
    surface.axes_W = target.rotation.normalized().toRotationMatrix();
    surface.friction = target.friction.value_or(contact.friction);
    if (contact.max_normal_N) surface.max_normal = *contact.max_normal_N / weight_N;
    if (contact.facts().forces == ContactForces::kBounded) surface.max_component = contact.max_force_N / weight_N;
    const double slide_m = kinematics == nullptr ? 0.0 : SlideAt(contact, target, *kinematics);
    surface.points_W = PointsAtTarget(contact, target, slide_m);
    surface.com_reach_m = ComReachOf(contact, target);
  }
  return surfaces;
}

bool SlidesUnderLoad(const Dataset& dataset, const Stance& stance) {
  return std::ranges::any_of(stance.contacts, [&](const ContactTarget& target) {
    return target.carries && dataset.contact(target.contact).SlideOf(target) > 0.0;
  });
}

StanceForces::StanceForces(const std::vector<TouchedSurface>& surfaces, FrictionPyramid pyramid) {
  const double widening =
      pyramid == FrictionPyramid::kInscribed ? 1.0 : 1.0 / std::cos(std::numbers::pi / kPyramidEdges);
  std::vector<Eigen::Matrix3Xd> directions;  // per surface
  Eigen::Index num_generators = 0;
  for (int s = 0; s < static_cast<int>(surfaces.size()); ++s) {
    const TouchedSurface& surface = surfaces[static_cast<size_t>(s)];
    directions.push_back(DirectionsOf(surface, widening));
    com_reach_m_ = std::max(com_reach_m_, surface.com_reach_m);
    for (const Eigen::Vector3d& position_W : surface.points_W) {
      points_.push_back({.surface = s, .link = surface.link, .position_W = position_W});
      origin_W_ += position_W;
      num_generators += directions.back().cols();
    }
    if (surface.max_normal && !surface.max_component) bounds_.push_back({.surface = s, .maximum = *surface.max_normal});
  }
  if (!points_.empty()) origin_W_ /= static_cast<double>(points_.size());
  if (!std::isfinite(com_reach_m_)) com_reach_m_ = 0.0;
  directions_.resize(3, num_generators);
  moments_.resizeLike(directions_);
  upper_.resize(num_generators);
  Eigen::Index generator = 0;
  for (size_t k = 0; k < points_.size(); ++k) {
    const auto surface = static_cast<size_t>(points_[k].surface);
    for (Eigen::Index edge = 0; edge < directions[surface].cols(); ++edge, ++generator) {
      generator_points_.push_back(static_cast<int>(k));
      directions_.col(generator) = directions[surface].col(edge);
      moments_.col(generator) = (points_[k].position_W - origin_W_).cross(directions_.col(generator));
      upper_[generator] = surfaces[surface].max_component.value_or(std::numeric_limits<double>::infinity());
    }
  }
}

}  // namespace legopt

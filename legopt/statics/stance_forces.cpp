#include "legopt/statics/stance_forces.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "legopt/dataset/contact.h"

namespace legopt {
namespace {

/// Returns where the contact's points are when it is at its target.
std::vector<Eigen::Vector3d> PointsAtTarget(const Contact& contact, const ContactTarget& target) {
  if (contact.kind == ContactKind::kPoint) {
    return {contact.OriginTarget(target) - contact.radius_m * NormalOf(target)};
  }
  const Eigen::Isometry3d X_WL = contact.LinkTarget(target);
  std::vector<Eigen::Vector3d> points_W;
  points_W.reserve(contact.points_L.size());
  for (const Eigen::Vector3d& point_L : contact.points_L) points_W.emplace_back(X_WL * point_L);
  return points_W;
}

}  // namespace

std::vector<TouchedSurface> SurfacesOf(const Dataset& dataset, const Stance& stance) {
  const double weight_N = dataset.robot().total_mass() * dataset.gravity_m_s2();
  std::vector<TouchedSurface> surfaces;
  for (const ContactTarget& target : stance.contacts) {
    const Contact& contact = dataset.contact(target.contact);
    TouchedSurface& surface = surfaces.emplace_back();
    surface.link = contact.link_index;
    surface.axes_W = target.rotation.normalized().toRotationMatrix();
    surface.friction = contact.friction;
    if (contact.max_normal_N) surface.max_normal = *contact.max_normal_N / weight_N;
    surface.points_W = PointsAtTarget(contact, target);
  }
  return surfaces;
}

StanceForces::StanceForces(const std::vector<TouchedSurface>& surfaces, FrictionPyramid pyramid) {
  for (int s = 0; s < static_cast<int>(surfaces.size()); ++s) {
    const TouchedSurface& surface = surfaces[static_cast<size_t>(s)];
    for (const Eigen::Vector3d& position_W : surface.points_W) {
      points_.push_back({.surface = s, .link = surface.link, .position_W = position_W});
      origin_W_ += position_W;
    }
    if (surface.max_normal) bounds_.push_back({.surface = s, .maximum = *surface.max_normal});
  }
  if (!points_.empty()) origin_W_ /= static_cast<double>(points_.size());
  directions_.resize(3, kPyramidEdges * static_cast<Eigen::Index>(points_.size()));
  moments_.resizeLike(directions_);
  const double widening =
      pyramid == FrictionPyramid::kInscribed ? 1.0 : 1.0 / std::cos(std::numbers::pi / kPyramidEdges);
  Eigen::Index generator = 0;
  for (const Point& point : points_) {
    const TouchedSurface& surface = surfaces[static_cast<size_t>(point.surface)];
    for (int edge = 0; edge < kPyramidEdges; ++edge, ++generator) {
      const double angle = 2.0 * std::numbers::pi * edge / kPyramidEdges;
      const Eigen::Vector3d tangent = std::cos(angle) * surface.axes_W.col(0) + std::sin(angle) * surface.axes_W.col(1);
      directions_.col(generator) = surface.axes_W.col(2) + widening * surface.friction * tangent;
      moments_.col(generator) = (point.position_W - origin_W_).cross(directions_.col(generator));
    }
  }
}

}  // namespace legopt

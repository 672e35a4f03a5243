#include "legopt/statics/collapse_motion.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace legopt {
namespace {

// Shares of the largest speed.
constexpr double kBrakeRounding = 1e-9;
constexpr double kAtRest = 1e-3;  // rounding of proofs, and motions too small to be seen
constexpr double kAtEdge = 1e-6;  // generators that do no work

double LargestSpeed(const CollapseMotion& motion, const StanceForces& forces) {
  double largest = motion.velocity.norm();
  for (const StanceForces::Point& point : forces.points()) {
    largest = std::max(largest, motion.At(point.position_W).norm());
  }
  return largest;
}

/// Movement of each point. `speed`: the largest speed of a point.
std::vector<ContactMovement> PointMovements(const CollapseMotion& motion, const StanceForces& forces, double speed) {
  std::vector<double> least(forces.points().size(), std::numeric_limits<double>::infinity());  // work of a force
  for (int l = 0; l < forces.num_generators(); ++l) {
    const auto point = static_cast<std::size_t>(forces.point_of(l));
    least[point] = std::min(least[point], forces.directions().col(l).dot(motion.At(forces.points()[point].position_W)));
  }
  std::vector<ContactMovement> movements;
  for (std::size_t k = 0; k < least.size(); ++k) {
    if (motion.At(forces.points()[k].position_W).norm() <= kAtRest * speed) {
      movements.push_back(ContactMovement::kRests);
    } else if (least[k] < -kAtEdge * speed) {
      movements.push_back(ContactMovement::kYields);
    } else {
      movements.push_back(least[k] <= kAtEdge * speed ? ContactMovement::kSlips : ContactMovement::kLifts);
    }
  }
  return movements;
}

/// The movement that stands for a surface: what resists in vain first, then what holds a part.
ContactMovement MovementOf(const std::vector<ContactMovement>& points) {
  for (const ContactMovement movement : {ContactMovement::kYields, ContactMovement::kSlips, ContactMovement::kRests}) {
    if (std::ranges::find(points, movement) != points.end()) return movement;
  }
  return ContactMovement::kLifts;
}

}  // namespace

Eigen::Vector3d CollapseMotion::At(const Eigen::Vector3d& position_W) const {
  return velocity + turn.cross(position_W - center_W);
}

double CollapseMargin(const CollapseMotion& motion, const StanceForces& forces, const Eigen::Vector3d& com_W) {
  const double speed = LargestSpeed(motion, forces);
  double margin = -motion.At(com_W).z();
  std::vector<double> largest_of_bound(forces.bounds().size(), 0.0);
  for (int l = 0; l < forces.num_generators(); ++l) {
    const StanceForces::Point& point = forces.points()[static_cast<std::size_t>(forces.point_of(l))];
    const double brake = -forces.directions().col(l).dot(motion.At(point.position_W));
    if (!(brake > kBrakeRounding * speed)) continue;
    if (std::isfinite(forces.upper()[l])) {
      margin -= forces.upper()[l] * brake;
      continue;
    }
    const auto bound = std::ranges::find_if(forces.bounds(), [&](const auto& b) { return b.surface == point.surface; });
    if (bound == forces.bounds().end()) return -std::numeric_limits<double>::infinity();
    double& largest = largest_of_bound[static_cast<std::size_t>(bound - forces.bounds().begin())];
    largest = std::max(largest, brake);
  }
  for (std::size_t i = 0; i < largest_of_bound.size(); ++i) margin -= forces.bounds()[i].maximum * largest_of_bound[i];
  return margin;
}

std::vector<SurfaceMovement> MovementsOf(const CollapseMotion& motion, const std::vector<TouchedSurface>& surfaces,
                                         const StanceForces& forces) {
  const double speed = LargestSpeed(motion, forces);
  const std::vector<ContactMovement> points = PointMovements(motion, forces, speed);
  std::vector<SurfaceMovement> movements;
  for (int s = 0; s < static_cast<int>(surfaces.size()); ++s) {
    std::vector<ContactMovement> own;
    for (std::size_t k = 0; k < points.size(); ++k) {
      if (forces.points()[k].surface == s) own.push_back(points[k]);
    }
    SurfaceMovement& movement = movements.emplace_back();
    movement.movement = MovementOf(own);
    const Eigen::Vector3d normal_W = surfaces[static_cast<std::size_t>(s)].axes_W.col(2);
    const auto count = static_cast<double>(std::ranges::count(own, movement.movement));
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < points.size(); ++k) {
      if (forces.points()[k].surface != s || points[k] != movement.movement) continue;
      const Eigen::Vector3d& position_W = forces.points()[k].position_W;
      Eigen::Vector3d velocity = motion.At(position_W);
      if (movement.movement == ContactMovement::kSlips) velocity -= velocity.dot(normal_W) * normal_W;
      movement.position_W += position_W / count;
      mean += velocity / count;
      movement.speed = std::max(movement.speed, velocity.norm() / speed);
    }
    if (movement.movement != ContactMovement::kRests && mean.norm() > 0.0) movement.direction_W = mean.normalized();
  }
  return movements;
}

}  // namespace legopt

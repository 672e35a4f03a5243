#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <cstring>

namespace legopt {

/// What GJK and EPA see of a convex shape: a core (points, or a solid cylinder) grown by `radius` in all directions.
///
/// A view in world coordinates; the arrays belong to someone else. Coordinates are separate arrays, `count` entries
/// each, a multiple of kLanes (pad by repeating a point). Kinds: hull and box = points, radius 0; sphere = one point;
/// capsule = two points; cylinder = count 0.
struct SupportSet {
  static constexpr int kLanes = 4;            ///< what counts are padded to: four doubles of a vector
  static constexpr double kUnbounded = 1e30;  ///< bound of a shape whose bounds nobody has filled in

  const double* x = nullptr;                         ///< first coordinates
  const double* y = nullptr;                         ///< second coordinates
  const double* z = nullptr;                         ///< third coordinates
  int count = 0;                                     ///< points, padding included; 0: a cylinder
  double radius = 0.0;                               ///< m
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< a point inside of the core

  /// Bounds of the core grown by the radius; may be loose. Only used to choose where to look first.
  Eigen::Vector3d lower = Eigen::Vector3d::Constant(-kUnbounded);
  /// Likewise, upper corner.
  Eigen::Vector3d upper = Eigen::Vector3d::Constant(kUnbounded);

  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< cylinder: unit
  double cylinder_radius = 0.0;                     ///< cylinder: m
  double half_length = 0.0;                         ///< cylinder: m

  /// Point of the core farthest along `direction` (any non-zero length). Of equal points the one with the smallest
  /// index in the lane order; deterministic.
  Eigen::Vector3d Farthest(const Eigen::Vector3d& direction) const {
    return count == 0 ? FarthestOnCylinder(direction) : Point(FarthestIndex(direction));
  }
  /// The same as an index; count > 0.
  int FarthestIndex(const Eigen::Vector3d& direction) const;
  /// One of the points, 0 <= i < count.
  Eigen::Vector3d Point(int i) const { return {x[i], y[i], z[i]}; }

  /// The same of a cylinder, count = 0.
  Eigen::Vector3d FarthestOnCylinder(const Eigen::Vector3d& direction) const;

 private:
  using Lane = double __attribute__((vector_size(8 * kLanes)));
  using Index = std::int64_t __attribute__((vector_size(8 * kLanes)));
};

/// Two chains of compare-and-blend over lanes; ties go to the smaller index of the smaller lane.
inline int SupportSet::FarthestIndex(const Eigen::Vector3d& d) const {
  const double dx = d.x();
  const double dy = d.y();
  const double dz = d.z();
  // Of any alignment. Out by reference: returning a lane would tie the build to one vector width.
  const auto dot = [&](int i, Lane& out) {
    Lane px;
    Lane py;
    Lane pz;
    std::memcpy(&px, x + i, sizeof(Lane));
    std::memcpy(&py, y + i, sizeof(Lane));
    std::memcpy(&pz, z + i, sizeof(Lane));
    out = px * dx + py * dy + pz * dz;
  };
  Lane best;
  Lane first;
  Lane second;
  dot(0, best);
  Index best_at = {0, 1, 2, 3};
  Lane other = best;
  Index other_at = best_at;
  Index at = best_at;
  int i = kLanes;
  for (; i + kLanes < count; i += 2 * kLanes) {
    at += kLanes;
    dot(i, first);
    const Index first_better = first > best;
    best = first_better ? first : best;
    best_at = first_better ? at : best_at;
    at += kLanes;
    dot(i + kLanes, second);
    const Index second_better = second > other;
    other = second_better ? second : other;
    other_at = second_better ? at : other_at;
  }
  if (i < count) {
    at += kLanes;
    dot(i, first);
    const Index better = first > best;
    best = better ? first : best;
    best_at = better ? at : best_at;
  }
  const Index better = (other > best) | ((other == best) & (other_at < best_at));
  best = better ? other : best;
  best_at = better ? other_at : best_at;
  int lane = 0;
  for (int k = 1; k < kLanes; ++k) {
    if (best[k] > best[lane]) lane = k;
  }
  return static_cast<int>(best_at[lane]);
}

inline Eigen::Vector3d SupportSet::FarthestOnCylinder(const Eigen::Vector3d& d) const {
  const double along = axis.dot(d);
  const Eigen::Vector3d across = d - along * axis;
  const double norm = across.norm();
  Eigen::Vector3d point = centre + axis * std::copysign(half_length, along);
  constexpr double kParallel = 1e-12;
  if (norm > kParallel * d.norm()) point += across * (cylinder_radius / norm);
  return point;
}

}  // namespace legopt

#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <cstring>

namespace legopt {

/// Convex shape for GJK and EPA: a core (points, or a solid cylinder) enlarged by `radius` in all directions.
///
/// A non-owning view in world coordinates. Coordinates are separate arrays with `count` entries each, a multiple of
/// kLanes (pad by repeating a point). Kinds: hull and box = points, radius 0; sphere = one point; capsule = two points;
/// cylinder = count 0.
struct SupportSet {
  static constexpr int kLanes = 4;            ///< counts are multiples of it: four doubles of a vector
  static constexpr double kUnbounded = 1e30;  ///< bound of a shape whose bounds are not set

  const double* x = nullptr;                         ///< x coordinates
  const double* y = nullptr;                         ///< y coordinates
  const double* z = nullptr;                         ///< z coordinates
  int count = 0;                                     ///< number of points including padding; 0: a cylinder
  double radius = 0.0;                               ///< m
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< a point inside the core

  /// Lower bounds of the shape, radius included; may be loose. Used only to choose the first search direction.
  Eigen::Vector3d lower = Eigen::Vector3d::Constant(-kUnbounded);
  /// Upper bounds of the shape, radius included; may be loose.
  Eigen::Vector3d upper = Eigen::Vector3d::Constant(kUnbounded);

  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< unit axis of a cylinder
  double cylinder_radius = 0.0;                     ///< m; cylinder only
  double half_length = 0.0;                         ///< m; cylinder only

  /// Returns the point of the core farthest along `direction` (any non-zero length). On a tie, the one with the
  /// smallest index in the lane order; deterministic.
  Eigen::Vector3d Farthest(const Eigen::Vector3d& direction) const {
    return count == 0 ? FarthestOnCylinder(direction) : Point(FarthestIndex(direction));
  }
  /// Returns the index of the farthest point; count > 0.
  int FarthestIndex(const Eigen::Vector3d& direction) const;
  /// Returns point i, 0 <= i < count.
  Eigen::Vector3d Point(int i) const { return {x[i], y[i], z[i]}; }

  /// Returns the farthest point of a cylinder, count = 0.
  Eigen::Vector3d FarthestOnCylinder(const Eigen::Vector3d& direction) const;

 private:
  using Lane = double __attribute__((vector_size(8 * kLanes)));
  using Index = std::int64_t __attribute__((vector_size(8 * kLanes)));
};

/// Runs two chains of compare-and-blend over lanes; ties go to the smaller index of the smaller lane.
inline int SupportSet::FarthestIndex(const Eigen::Vector3d& d) const {
  const double dx = d.x();
  const double dy = d.y();
  const double dz = d.z();
  // Loads from any alignment. Output by reference: returning a lane would tie the ABI to one vector width.
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

/// Signed distance of one pair, with normal and witness points; signs as in collision_query.h.
struct PairDistance {
  double distance_m = 0.0;
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit vector from B to A
  Eigen::Vector3d point_a = Eigen::Vector3d::Zero();  ///< on the surface of A
  Eigen::Vector3d point_b = Eigen::Vector3d::Zero();  ///< on the surface of B
};

/// Warm start for a pair of shapes: the separating direction and the nearest feature of an earlier call.
struct DistanceHint {
  Eigen::Vector3f direction = Eigen::Vector3f::Zero();  ///< direction from B to A, of any length; zero: unknown
  std::uint16_t a[3] = {0, 0, 0};                       ///< point indices in A of the nearest feature's corners
  std::uint16_t b[3] = {0, 0, 0};                       ///< point indices in B of the nearest feature's corners
  std::uint8_t size = 0;                                ///< number of corners, 0 to 3
};

/// Computes the signed distance of two convex shapes. Returns false, without changing `result`, if it is not below
/// `cutoff_m`.
///
/// Separate cores: GJK, which stops early if a separating plane proves a distance >= cutoff. Overlapping cores: EPA.
/// Exact for polytopes and spheres up to rounding (about 1e-9 m), for cylinders to about 1e-7 m. Deterministic, no
/// state, no allocation. Flat, degenerate and touching shapes are allowed; if the normal is not unique, one of the
/// valid ones is returned.
///
/// `hint`: result of an earlier call for these two shapes, in any poses; it is updated. Good hints save most of GJK's
/// iterations; any hint gives the same distance and normal up to rounding.
bool SignedDistance(const SupportSet& a, const SupportSet& b, double cutoff_m, PairDistance& result,
                    DistanceHint* hint = nullptr);

// Internal interface between GJK and EPA.

/// A vertex of the Minkowski difference A - B, and the points whose difference it is.
struct DifferencePoint {
  Eigen::Vector3d w,  ///< a - b
      a,              ///< point of A
      b;              ///< point of B
  int ia = -1;        ///< index of a; -1 for a cylinder
  int ib = -1;        ///< index of b; -1 for a cylinder
};

/// Corners of the smallest feature that contains the point nearest to the origin, with its barycentric weights.
struct Simplex {
  DifferencePoint points[4];  ///< the first `size` are used
  double weights[4];          ///< weights of the points, >= 0, sum 1
  int size = 0;               ///< 1 to 4 corners
};

/// Returns the point of A - B farthest along `direction` (any non-zero length). Cores only, without the radii.
inline DifferencePoint SupportOfDifference(const SupportSet& a, const SupportSet& b, const Eigen::Vector3d& direction) {
  DifferencePoint point;
  const auto farthest = [](const SupportSet& set, const Eigen::Vector3d& along, int& index) -> Eigen::Vector3d {
    if (set.count == 0) return set.FarthestOnCylinder(along);
    index = set.FarthestIndex(along);
    return set.Point(index);
  };
  point.a = farthest(a, direction, point.ia);
  point.b = farthest(b, -direction, point.ib);
  point.w = point.a - point.b;
  return point;
}

/// Computes by EPA the shortest translation that separates overlapping cores; `simplex` must contain the origin. The
/// distance is <= 0 up to rounding and excludes the radii.
PairDistance ComputePenetration(const SupportSet& a, const SupportSet& b, const Simplex& simplex);

}  // namespace legopt

#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "legopt/geometry/support_set.h"

namespace legopt {

/// Signed distance of one pair, with normal and witness points; signs as in proximity_pair.h.
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

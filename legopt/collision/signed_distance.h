#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "legopt/collision/support_set.h"

namespace legopt {

/// Result of one pair; signs as in contact.h.
struct PairDistance {
  double distance_m = 0.0;                            ///< signed
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, from B to A
  Eigen::Vector3d point_a = Eigen::Vector3d::Zero();  ///< on A
  Eigen::Vector3d point_b = Eigen::Vector3d::Zero();  ///< on B
};

/// What parted two shapes, or where they were nearest: where to look first when they have moved a little.
struct NearestHint {
  Eigen::Vector3f direction = Eigen::Vector3f::Zero();  ///< from B to A, of any length; zero: nothing is known
  std::uint16_t a[3] = {0, 0, 0};                       ///< corners of the nearest feature: points of A, by index
  std::uint16_t b[3] = {0, 0, 0};                       ///< and of B
  std::uint8_t size = 0;                                ///< how many corners, 0 to 3
};

/// Signed distance of two convex shapes when it is smaller than `cutoff_m`; false, with `result` untouched, otherwise.
///
/// Apart: GJK; leaves early once a separating plane proves a distance >= cutoff. Cores that overlap: EPA. Exact for
/// polytopes and spheres up to round-off (about 1e-9 m), for cylinders to about 1e-7 m. Deterministic, no state, no
/// allocation. Flat, degenerate and touching shapes are legal; where the normal is not unique, one of the valid ones is
/// returned.
///
/// `hint`: of an earlier call for these two shapes, in whatever poses; it is replaced by what this call has found. Good
/// hints save most of GJK's iterations; any gives the same distance and normal but for round-off.
bool SignedDistance(const SupportSet& a, const SupportSet& b, double cutoff_m, PairDistance& result,
                    NearestHint* hint = nullptr);

// Internal to the two halves of the algorithm.

/// A vertex of the Minkowski difference A - B and the points it comes from.
struct DifferencePoint {
  Eigen::Vector3d w,  ///< a - b
      a,              ///< of A
      b;              ///< of B
  int ia = -1;        ///< index of a; -1 on a cylinder
  int ib = -1;        ///< likewise of b
};

/// Corners of the smallest feature that holds the point nearest to the origin, with its barycentric weights.
struct Simplex {
  DifferencePoint points[4];  ///< the first `size` count
  double weights[4];          ///< of the points, >= 0, sum 1
  int size = 0;               ///< 1 to 4 corners
};

/// The point of A - B farthest along `direction` (any non-zero length). Cores only: the radii are not included.
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

/// EPA: shortest translation out of A - B for cores that overlap (the origin lies in or on `simplex`). Distance <= 0 up
/// to round-off; the radii are not included.
PairDistance CorePenetration(const SupportSet& a, const SupportSet& b, const Simplex& simplex);

}  // namespace legopt

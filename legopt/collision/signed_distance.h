#pragma once

#include <Eigen/Core>

#include "legopt/collision/support_set.h"

namespace legopt {

/// Result of one pair; signs as in contact.h.
struct PairDistance {
  double distance_m = 0.0;                            ///< signed
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, from B to A
  Eigen::Vector3d point_a = Eigen::Vector3d::Zero();  ///< on A
  Eigen::Vector3d point_b = Eigen::Vector3d::Zero();  ///< on B
};

/// Signed distance of two convex shapes when it is smaller than `cutoff_m`; false, with `result` untouched, otherwise.
///
/// Apart: GJK; leaves early once a separating plane proves a distance >= cutoff. Cores that overlap: EPA. Exact for
/// polytopes and spheres up to round-off (about 1e-9 m), for cylinders to about 1e-7 m. Deterministic, no state, no
/// allocation. Flat, degenerate and touching shapes are legal; where the normal is not unique, one of the valid ones is
/// returned.
bool SignedDistance(const SupportSet& a, const SupportSet& b, double cutoff_m, PairDistance& result);

// Internal to the two halves of the algorithm.

/// A vertex of the Minkowski difference A - B and the points it comes from.
struct DifferencePoint {
  Eigen::Vector3d w,  ///< a - b
      a,              ///< of A
      b;              ///< of B
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
  point.a = a.Farthest(direction);
  point.b = b.Farthest(-direction);
  point.w = point.a - point.b;
  return point;
}

/// EPA: shortest translation out of A - B for cores that overlap (the origin lies in or on `simplex`). Distance <= 0 up
/// to round-off; the radii are not included.
PairDistance CorePenetration(const SupportSet& a, const SupportSet& b, const Simplex& simplex);

}  // namespace legopt

#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

namespace legopt {

/// Half space n . p + offset <= 0.
struct HalfSpace {
  Eigen::Vector3d normal;  ///< outward unit vector
  double offset;           ///< m
};

/// Convex hull of points. The hull of a flat set has vertices, but no facets and no volume.
struct ConvexHull {
  std::vector<Eigen::Vector3d> vertices;      ///< a subset of the points, in their order
  std::vector<HalfSpace> facets;              ///< half spaces whose intersection is the hull; none for flat hulls
  std::vector<std::array<int, 3>> triangles;  ///< indices into `vertices`, outward winding; none for flat hulls
  double volume_m3 = 0.0;                     ///< 0 for flat hulls

  bool flat() const { return facets.empty(); }  ///< true if the points lie in a plane, on a line or in a point
  /// Returns the largest n . p + offset: < 0 inside, minus the distance from the boundary; > 0 outside, a lower bound
  /// of the distance.
  double PlaneDistance(const Eigen::Vector3d& point) const;
};

/// Computes a convex hull with Qhull (reentrant, no global state, no output). Vertices are a subset of `points`, in
/// their order, so that equal input gives equal output. Sets thinner than about 1e-9 of their size give flat hulls.
/// Aborts if `points` is empty or not finite.
ConvexHull ComputeHull(std::span<const Eigen::Vector3d> points);

}  // namespace legopt

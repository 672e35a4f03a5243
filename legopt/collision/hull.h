#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

namespace legopt {

/// Half space n . p + offset <= 0, n a unit vector pointing out.
struct HalfSpace {
  Eigen::Vector3d normal;  ///< unit, pointing out
  double offset;           ///< m
};

/// Convex hull of points. A flat set of points keeps its vertices and has no facets and no volume.
struct ConvexHull {
  std::vector<Eigen::Vector3d> vertices;      ///< a subset of the points, in their order
  std::vector<HalfSpace> facets;              ///< whose intersection is the hull; none for flat hulls
  std::vector<std::array<int, 3>> triangles;  ///< of `vertices`, outward winding; none for flat hulls
  double volume_m3 = 0.0;                     ///< 0 for flat hulls

  bool flat() const { return facets.empty(); }  ///< the points lie in a plane, on a line or in a point
  /// Largest n . p + offset: < 0 inside, by the distance to the boundary; > 0 outside (a lower bound of the distance).
  double PlaneDistance(const Eigen::Vector3d& point) const;
};

/// Convex hull by Qhull (reentrant; no global state, prints nothing). Vertices are a subset of `points`, in their
/// order, so that equal input gives equal output. Sets of points thinner than about 1e-9 of their size come back flat.
/// `points` must not be empty; coordinates finite (checked; violation aborts).
ConvexHull ComputeHull(std::span<const Eigen::Vector3d> points);

}  // namespace legopt

#pragma once

#include <span>
#include <vector>

#include "legopt/geometry/hull.h"
#include "legopt/geometry/mesh.h"

namespace legopt {

/// Limits of a decomposition, which stops when the first one is reached.
struct DecompositionLimits {
  double concavity_m = 0.02;  ///< maximum deviation of a piece from the mesh, m
  int max_pieces = 16;        ///< >= 1
};

/// Returns true if the whole surface lies within `tolerance_m` of the boundary of its hull.
bool IsConvex(const TriangleMesh& mesh, const ConvexHull& hull, double tolerance_m = 2e-4);

/// Decomposes a mesh (closed or not) into convex pieces that together contain all its triangles.
///
/// Repeatedly selects the piece with the largest concavity, cuts its triangles with the plane that minimizes the sum of
/// hull volumes, and computes the hulls of both sides. The concavity of a piece is the maximum distance from a facet of
/// its hull to the mesh, measured inwards along the facet's normal; facets made by cuts do not count. Deterministic.
std::vector<ConvexHull> DecomposeApproximately(const TriangleMesh& mesh, const DecompositionLimits& limits);

/// Decomposes every body of the mesh (mesh_components.h) separately, with the limits for each. No piece bridges the gap
/// between two bodies, into which another link may reach.
std::vector<ConvexHull> DecomposeBodies(const TriangleMesh& mesh, const DecompositionLimits& limits);

}  // namespace legopt

#pragma once

#include <span>
#include <vector>

#include "legopt/collision/hull.h"
#include "legopt/collision/mesh.h"

namespace legopt {

/// When a decomposition is fine enough: whichever is reached first.
struct DecompositionLimits {
  double concavity_m = 0.02;  ///< stop when no piece stands off from the mesh by more than this, m
  int max_pieces = 16;        ///< >= 1
};

/// True when all of the surface lies within `tolerance_m` of the boundary of its hull.
bool IsConvex(const TriangleMesh& mesh, const ConvexHull& hull, double tolerance_m = 2e-4);

/// Convex pieces that together contain every triangle of the mesh (closed or not).
///
/// Repeatedly takes the piece with the largest concavity, cuts its triangles with the plane that leaves the smallest
/// sum of hull volumes, and hulls both sides. Concavity of a piece: how far one can move in from its hull, against the
/// facet's normal, before meeting the mesh; facets made by cuts do not count. Deterministic.
std::vector<ConvexHull> DecomposeApproximately(const TriangleMesh& mesh, const DecompositionLimits& limits);

/// The same of every body of the mesh (mesh_components.h) by itself, the limits for each: no piece bridges the gap
/// between two bodies, into which another link may reach.
std::vector<ConvexHull> DecomposeBodies(const TriangleMesh& mesh, const DecompositionLimits& limits);

}  // namespace legopt

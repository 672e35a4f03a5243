#pragma once

#include <vector>

#include "legopt/geometry/collision_model.h"
#include "legopt/geometry/internal/convex_shape.h"
#include "legopt/geometry/internal/mesh.h"

namespace legopt {

/// Returns the convex pieces of a link's mesh for a scene of solids, in the link's frame; `hull` is the mesh's hull.
///
/// A convex mesh gives its hull. The bodies of a concave one are converted as for scenes (SolidsOfMesh), if there are
/// few, all closed and of at most 2,000 triangles; else the whole mesh is decomposed approximately (DecomposeBySample),
/// since link meshes of CAD programs often consist of hundreds of screws and shells. At most
/// CollisionOptions::max_component_pieces pieces. Deterministic.
std::vector<ConvexShape> PiecesOfLinkMesh(const TriangleMesh& mesh, const ConvexHull& hull,
                                          const CollisionOptions& options);

}  // namespace legopt

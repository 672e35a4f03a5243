#pragma once

#include <vector>

#include "legopt/geometry/collision_model.h"
#include "legopt/geometry/convex_shape.h"
#include "legopt/geometry/mesh.h"
#include "legopt/geometry/scene.h"

namespace legopt {

/// Builds the convex solids of all scene objects in world coordinates, as described for CollisionModel under "Scene".
/// Throws InputError with the object's name for meshes that cannot be loaded and bad sizes.
std::vector<ConvexShape> BuildSceneSolids(const Scene& scene, const CollisionOptions& options);

/// Returns the convex shapes of one mesh, in its frame.
std::vector<ConvexShape> SolidsOfMesh(const TriangleMesh& mesh, const CollisionOptions& options);

/// Collects the triangles of all scene objects in world coordinates, with primitives tessellated, in the order of
/// objects and files. Throws like BuildSceneSolids.
TriangleMesh CollectSceneTriangles(const Scene& scene);

}  // namespace legopt

#pragma once

#include <vector>

#include "legopt/collision/collision_model.h"
#include "legopt/collision/convex_shape.h"
#include "legopt/collision/mesh.h"
#include "legopt/collision/scene.h"

namespace legopt {

/// Convex solids of all scene objects, in world coordinates: what CollisionModel describes under "Scene".
/// Throws InputError for meshes that cannot be loaded and bad sizes; the message names the object.
std::vector<ConvexShape> BuildSceneSolids(const Scene& scene, const CollisionOptions& options);

/// Convex shapes of one mesh, in its frame.
std::vector<ConvexShape> SolidsOfMesh(const TriangleMesh& mesh, const CollisionOptions& options);

/// Triangles of all scene objects, primitives tessellated, in world coordinates: objects in their order, triangles in
/// the order of their files. Throws as BuildSceneSolids.
TriangleMesh CollectSceneTriangles(const Scene& scene);

}  // namespace legopt

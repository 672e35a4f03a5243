#pragma once

#include <vector>

#include "legopt/collision/collision_model.h"
#include "legopt/collision/convex_shape.h"
#include "legopt/collision/scene.h"

namespace legopt {

/// Convex solids of all scene objects, in world coordinates: what CollisionModel describes under "Scene".
/// Throws InputError for meshes that cannot be loaded and bad sizes; the message names the object.
std::vector<ConvexShape> BuildSceneSolids(const Scene& scene, const CollisionOptions& options);

/// Convex shapes of one mesh, in its frame.
std::vector<ConvexShape> SolidsOfMesh(const TriangleMesh& mesh, const CollisionOptions& options);

}  // namespace legopt

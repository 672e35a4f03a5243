#pragma once

#include "legopt/geometry/collision_model.h"
#include "legopt/geometry/mesh.h"

namespace legopt {

/// Triangles of the solver's convex shapes, for display; curved surfaces are tessellated. A shape without volume
/// contributes only its triangle, if it is one.

/// Returns the surfaces of a link, in its frame, m: the finer pieces if there are any, else one hull or primitive per
/// geometry. Empty for a link without geometry.
TriangleMesh LinkSurfaces(const CollisionModel& model, int link);

/// Returns the surfaces of all solid obstacles, in the world, m. Empty for a scene as a surface, which is its own mesh.
TriangleMesh SceneSurfaces(const CollisionModel& model);

}  // namespace legopt

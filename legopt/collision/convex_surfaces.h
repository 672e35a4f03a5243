#pragma once

#include "legopt/collision/collision_model.h"
#include "legopt/collision/mesh.h"

namespace legopt {

/// What a solver sees of a robot and a scene, as triangles for people to look at: the surfaces of convex shapes,
/// curved ones tessellated. A shape without volume gives nothing but its triangle, if it is one.

/// Of a link, in its frame, m: the finer pieces where it has such, else one hull or primitive per geometry. Empty for
/// a link without geometry.
TriangleMesh LinkSurfaces(const CollisionModel& model, int link);

/// Of all solid obstacles, in the world, m. A scene as a surface is its own mesh, and gives nothing here.
TriangleMesh SceneSurfaces(const CollisionModel& model);

}  // namespace legopt

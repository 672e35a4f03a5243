#pragma once

#include <optional>
#include <vector>

#include "legopt/geometry/collision_model.h"
#include "legopt/geometry/internal/convex_shape.h"
#include "legopt/geometry/internal/mesh.h"
#include "legopt/geometry/scene.h"

namespace legopt {

/// A body between a top and a bottom plane with vertical walls. In plan it is any polygon, possibly with holes.
struct VerticalPrism {
  /// Top plane: z = c0 + c1 x + c2 y
  Eigen::Vector3d top;
  /// Bottom plane: z = c0 + c1 x + c2 y
  Eigen::Vector3d bottom;
  std::vector<Eigen::Vector3d> vertices;      ///< vertices of the top surface
  std::vector<std::array<int, 3>> triangles;  ///< triangles of the top surface, counter-clockwise in plan
};

/// Returns the component as a vertical prism, or nothing if it deviates from one by more than `tolerance_m` [m].
/// Slivers and a few open edges are tolerated: only the two surfaces are used.
std::optional<VerticalPrism> RecogniseVerticalPrism(const TriangleMesh& component, double tolerance_m = 1e-4);

/// Cuts prisms into convex pieces, each given by its corners on the two planes.
///
/// Prisms with the same two planes are joined first, where their top triangles share edges. Neighbouring triangles are
/// merged while the merged polygon is convex (dents of up to `dent_m` are filled sideways, never above the surface).
std::vector<std::vector<Eigen::Vector3d>> CutIntoConvexPrisms(const std::vector<VerticalPrism>& prisms,
                                                              double dent_m = 2e-4);

/// Builds the convex solids of all scene objects in world coordinates, as described for CollisionModel under "Scene".
/// Throws InputError with the object's name for meshes that cannot be loaded and bad sizes.
std::vector<ConvexShape> BuildSceneSolids(const Scene& scene, const CollisionOptions& options);

/// Returns the convex shapes of one mesh, in its frame.
std::vector<ConvexShape> SolidsOfMesh(const TriangleMesh& mesh, const CollisionOptions& options);

/// Collects the triangles of all scene objects in world coordinates, with primitives tessellated, in the order of
/// objects and files. Throws like BuildSceneSolids.
TriangleMesh CollectSceneTriangles(const Scene& scene);

}  // namespace legopt

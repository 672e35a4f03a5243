#include "legopt/geometry/internal/link_pieces.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "legopt/geometry/internal/convex_decomposition.h"
#include "legopt/geometry/internal/mesh_bodies.h"
#include "legopt/geometry/internal/scene_solids.h"

namespace legopt {
namespace {

constexpr size_t kFewBodies = 8, kFewTriangles = 2'000;

}  // namespace

std::vector<ConvexShape> PiecesOfLinkMesh(const TriangleMesh& mesh, const ConvexHull& hull,
                                          const CollisionOptions& options) {
  if (IsConvex(mesh, hull)) return {ConvexShape::FromHull(hull)};
  const std::vector<TriangleMesh> bodies =
      mesh.triangles.size() <= kFewTriangles ? SplitIntoComponents(mesh) : std::vector<TriangleMesh>();
  if (!bodies.empty() && bodies.size() <= kFewBodies && std::ranges::all_of(bodies, IsClosed)) {
    std::vector<ConvexShape> solids = SolidsOfMesh(mesh, options);
    if (!solids.empty() && std::ssize(solids) <= options.max_component_pieces) return solids;
  }
  std::vector<ConvexShape> pieces;
  const DecompositionLimits limits{options.scene_concavity_m, options.max_component_pieces};
  for (ConvexHull& piece : DecomposeBySample(mesh, limits)) {
    pieces.push_back(ConvexShape::FromHull(std::move(piece)));
  }
  return pieces;
}

}  // namespace legopt

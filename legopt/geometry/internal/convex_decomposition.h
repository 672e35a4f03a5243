#pragma once

#include <map>
#include <set>
#include <span>
#include <vector>

#include "legopt/geometry/internal/convex_shape.h"
#include "legopt/geometry/internal/mesh.h"
#include "legopt/robot/robot_model.h"

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

/// Decomposes like DecomposeApproximately, but chooses the cuts on a mesh of at most `max_triangles` triangles, made by
/// merging near vertices; then applies them to all triangles. For meshes of CAD programs, in a small part of the time.
std::vector<ConvexHull> DecomposeBySample(const TriangleMesh& mesh, const DecompositionLimits& limits,
                                          int max_triangles = 2'000);

/// Decomposes every body of the mesh (mesh_bodies.h) separately, with the limits for each. No piece bridges the gap
/// between two bodies, into which another link may reach.
std::vector<ConvexHull> DecomposeBodies(const TriangleMesh& mesh, const DecompositionLimits& limits);

/// How a mesh is decomposed as a whole.
enum class DecompositionMethod {
  kAllTriangles,  ///< DecomposeApproximately
  kSample,        ///< DecomposeBySample
};

/// Convex shapes that together cover the geometry of a link, in the link's frame: primitives unchanged, meshes
/// decomposed. Computed on demand and kept. Not thread-safe.
class LinkPieces {
 public:
  /// `robot` must outlive this object. `method` decomposes meshes as a whole.
  LinkPieces(const RobotModel& robot, const DecompositionLimits& limits, DecompositionMethod method)
      : robot_(robot), limits_(limits), method_(method) {}

  /// Computes the Pieces() of several links, some at once. Throws InputError.
  void PreparePieces(const std::set<int>& links);
  /// Returns the pieces with meshes decomposed as a whole. Throws InputError.
  const std::vector<ConvexShape>& Pieces(int link);
  /// Returns the pieces with meshes decomposed body by body (DecomposeBodies). Throws InputError.
  const std::vector<ConvexShape>& Bodies(int link);

 private:
  std::vector<ConvexHull> DecomposeWhole(const TriangleMesh& mesh) const;

  const RobotModel& robot_;
  DecompositionLimits limits_;
  DecompositionMethod method_;
  std::map<int, std::vector<ConvexShape>> pieces_, bodies_;
};

}  // namespace legopt

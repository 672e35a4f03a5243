#pragma once

#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "legopt/geometry/internal/mesh.h"
#include "legopt/geometry/internal/triangle_bvh.h"

namespace legopt {

/// Splits a mesh into bodies: sets of triangles connected by edges.
///
/// Bodies may touch. If more than two triangles share an edge (solids with a common wall or edge), each triangle is
/// connected only to the one that closes the same solid, found by rotating about the edge through the material. Open
/// edges and inconsistent winding are tolerated: two triangles alone on an edge are connected whatever their winding.
/// Components are in the order of their first triangle; triangles keep their order; vertices are renumbered.
std::vector<TriangleMesh> SplitIntoComponents(const TriangleMesh& mesh);

/// Returns the indices of the triangles of each component, in the order of SplitIntoComponents.
std::vector<std::vector<int>> GroupTrianglesByComponent(const TriangleMesh& mesh);

/// Faults of a mesh that should bound solids. An edge is open if its triangles do not pair up in opposite directions; a
/// component (mesh_bodies.h) with such an edge is open.
struct MeshFaults {
  int edges = 0;                ///< number of distinct edges
  int open_edges = 0;           ///< number of open edges
  int components = 0;           ///< number of connected bodies
  int open_components = 0;      ///< number of components with an open edge
  int inverted_components = 0;  ///< number of components with negative volume and at most 1 % open edges
  bool none() const { return open_edges == 0 && inverted_components == 0; }  ///< true if the mesh bounds solids
};
/// Returns true if all edges pair up, so that the mesh has an inside.
bool IsClosed(const TriangleMesh& mesh);

/// Counts the faults of a mesh; never throws.
MeshFaults FindMeshFaults(const TriangleMesh& mesh);

/// Returns the mesh with the triangles of inverted components flipped; components are concatenated.
TriangleMesh FlipInvertedComponents(const TriangleMesh& mesh);

/// Closed bodies of a triangle mesh, and the depth of points inside them.
///
/// A body is a connected component (mesh_bodies.h) without open edges (mesh_bodies.h); other components enclose
/// nothing and are ignored. A point p is inside if its winding number about the mesh is not zero,
///
///     w(p) = sum of w_t(p) over the triangles t that lie above p
///
/// with w_t the winding number of t, projected along z, about the projected p. Each edge contributes opposite values to
/// its two triangles, whatever the rounding, so that rays through vertices or along edges need no special treatment.
/// Bodies with outward winding add 1, the wall of a cavity subtracts 1, and inverted bodies still have an inside.
///
/// Immutable and thread-safe.
class ClosedBodies {
 public:
  /// Copies the closed components of `mesh`, whose equal vertices must be welded (as LoadMesh and Tessellate do).
  explicit ClosedBodies(const TriangleMesh& mesh);

  /// One closed body.
  struct Body {
    Eigen::AlignedBox3d bounds;  ///< bounding box, m
    int first_vertex = 0;        ///< index of its first vertex in vertices()
    int num_vertices = 0;        ///< number of its vertices
  };
  const std::vector<Body>& bodies() const { return bodies_; }  ///< ordered by first triangle
  /// Returns the vertices of a body, in the frame of the mesh, m.
  std::span<const Eigen::Vector3d> vertices(const Body& body) const {
    return std::span(mesh_.vertices)
        .subspan(static_cast<size_t>(body.first_vertex), static_cast<size_t>(body.num_vertices));
  }

  /// Returns the depth of a point: its distance from the nearest surface of a body, m; 0 outside all bodies. `point` in
  /// the frame of the mesh.
  double Depth(const Eigen::Vector3d& point) const;

 private:
  bool Contains(const Eigen::Vector3d& point) const;
  double DistanceToSurface(const Eigen::Vector3d& point) const;

  std::vector<Body> bodies_;  ///< filled during the construction of mesh_
  TriangleMesh mesh_;         ///< the closed components, concatenated
  TriangleBvh bvh_;
  Eigen::AlignedBox3d bounds_;
};

}  // namespace legopt

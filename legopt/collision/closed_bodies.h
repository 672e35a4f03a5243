#pragma once

#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "legopt/collision/mesh.h"
#include "legopt/collision/triangle_bvh.h"

namespace legopt {

/// What is inside of a triangle mesh: its closed bodies, and how deep points lie in them.
///
/// A body is a connected component (mesh_components.h) without an open edge (mesh_faults.h); other components bound
/// nothing and are left out. A point p is inside when its winding number about the mesh is not zero,
///
///     w(p) = sum of w_t(p) over the triangles t that lie above p
///
/// with w_t the winding number of t, projected along z, about the projected p. Every side of a triangle adds to w_t
/// what it takes from the neighbour's, whatever its rounding, so that a ray through a vertex or along an edge counts
/// like any other. Bodies wound outwards add 1, a cavity's wall takes 1 away, and bodies that are inside out still have
/// an inside.
///
/// Immutable; any number of threads.
class ClosedBodies {
 public:
  /// Copies what it needs of `mesh`, whose equal vertices must be welded (LoadMesh and Tessellate do).
  explicit ClosedBodies(const TriangleMesh& mesh);

  /// One body.
  struct Body {
    Eigen::AlignedBox3d bounds;  ///< of its vertices, m
    int first_vertex = 0;        ///< of its vertices within vertices()
    int num_vertices = 0;        ///< how many those are
  };
  const std::vector<Body>& bodies() const { return bodies_; }  ///< in the order of their first triangles
  /// Of one body, in the frame of the mesh, m.
  std::span<const Eigen::Vector3d> vertices(const Body& body) const {
    return std::span(mesh_.vertices)
        .subspan(static_cast<size_t>(body.first_vertex), static_cast<size_t>(body.num_vertices));
  }

  /// How deep a point lies: its distance to the nearest surface of a body, m; 0 outside of all bodies. `point` in the
  /// frame of the mesh.
  double Depth(const Eigen::Vector3d& point) const;

 private:
  bool Contains(const Eigen::Vector3d& point) const;
  double DistanceToSurface(const Eigen::Vector3d& point) const;

  std::vector<Body> bodies_;  ///< filled while mesh_ is made
  TriangleMesh mesh_;         ///< the closed components, one after the other
  TriangleBvh bvh_;
  Eigen::AlignedBox3d bounds_;
};

}  // namespace legopt

#pragma once

#include "legopt/geometry/mesh.h"

namespace legopt {

/// Faults of a mesh that should bound solids. An edge is open if its triangles do not pair up in opposite directions; a
/// component (mesh_components.h) with such an edge is open.
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

}  // namespace legopt

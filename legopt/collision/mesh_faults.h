#pragma once

#include "legopt/collision/mesh.h"

namespace legopt {

/// Faults of a mesh that ought to bound solids. An edge is open when the triangles that use it do not pair up in
/// opposite directions; a component (mesh_components.h) with such an edge is open.
struct MeshFaults {
  int edges = 0;                ///< of all triangles, each once
  int open_edges = 0;           ///< of them, open ones
  int components = 0;           ///< connected bodies
  int open_components = 0;      ///< of them, those with an open edge
  int inverted_components = 0;  ///< of negative volume; closed but for at most 1 % of their edges
  bool none() const { return open_edges == 0 && inverted_components == 0; }  ///< sound enough to bound solids
};
/// Whether every edge pairs up, so that the mesh has an inside.
bool IsClosed(const TriangleMesh& mesh);

/// Counts them; never throws.
MeshFaults FindMeshFaults(const TriangleMesh& mesh);

/// The same mesh with the triangles of those inverted components turned round; components come one after the other.
TriangleMesh TurnInvertedComponents(const TriangleMesh& mesh);

}  // namespace legopt

#pragma once

#include "legopt/geometry/internal/mesh.h"

namespace legopt {

/// A link's mesh after repair, and the changes.
struct RepairedLinkMesh {
  TriangleMesh mesh;
  int bodies = 0;     ///< number of bodies: triangles connected by edges that exactly two triangles share
  int turned = 0;     ///< bodies with triangles that were turned round
  int welded = 0;     ///< vertices that were welded to others
  bool flat = false;  ///< all vertices lie in a plane
  bool changed() const { return turned > 0 || welded > 0; }  ///< true if the mesh differs from the one given
};

/// Orients the bodies of a link's mesh one by one, so that each encloses a positive volume. The winding within a body
/// is made consistent first. Bodies may touch in corners, edges and faces. A closed body with negative volume inside a
/// body with positive volume is the wall of a cavity and stays. Bodies with more than 1 % open edges are only made
/// consistent. Vertices of an open mesh that are at most 10 um apart are welded first. Deterministic; never throws.
RepairedLinkMesh RepairLinkMesh(const TriangleMesh& mesh);

}  // namespace legopt

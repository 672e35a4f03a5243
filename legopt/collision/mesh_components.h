#pragma once

#include <vector>

#include "legopt/collision/mesh.h"

namespace legopt {

/// Splits a mesh into bodies: sets of triangles joined by edges.
///
/// Bodies may touch: where more than two triangles meet in an edge (solids that share a wall or an edge), each triangle
/// is joined only to the one that closes the same solid, found by turning about the edge through the material. Open
/// edges and inconsistent winding are tolerated: two triangles that are alone on an edge are joined however they are
/// wound. Components come in the order of their first triangle; triangles keep their order; vertices are renumbered.
std::vector<TriangleMesh> SplitIntoComponents(const TriangleMesh& mesh);

}  // namespace legopt

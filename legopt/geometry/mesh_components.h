#pragma once

#include <vector>

#include "legopt/geometry/mesh.h"

namespace legopt {

/// Splits a mesh into bodies: sets of triangles connected by edges.
///
/// Bodies may touch. If more than two triangles share an edge (solids with a common wall or edge), each triangle is
/// connected only to the one that closes the same solid, found by rotating about the edge through the material. Open
/// edges and inconsistent winding are tolerated: two triangles alone on an edge are connected whatever their winding.
/// Components are in the order of their first triangle; triangles keep their order; vertices are renumbered.
std::vector<TriangleMesh> SplitIntoComponents(const TriangleMesh& mesh);

}  // namespace legopt

#pragma once

#include <vector>

#include "legopt/collision/mesh.h"
#include "legopt/generate/building.h"
#include "legopt/generate/collapse.h"
#include "legopt/generate/fracture.h"

namespace legopt::generate {

/// One convex solid of a scenario, world frame; coordinates are representable as float.
struct Piece {  ///< of the hull, m
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::vector<int>> faces;  ///< as in Cell
  int member = -1;                      ///< index in Building::members
};

/// The solids of a snapshot: members none of whose cells has moved as a whole, of the others every cell that is left
/// where the simulation put it. Cells thrown farther than `margin_m` beyond the plan are left out.
std::vector<Piece> PiecesOf(const Building& building, const std::vector<Cell>& cells, const Snapshot& snapshot,
                            double margin_m = 6.0);

/// All pieces as one mesh: each is a closed surface with outward winding; faces are cut into fans of triangles.
/// Vertices of different pieces are separate. `piece_of_triangle` may be null.
TriangleMesh MeshOf(const std::vector<Piece>& pieces, std::vector<int>* piece_of_triangle = nullptr);

}  // namespace legopt::generate

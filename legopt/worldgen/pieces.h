#pragma once

#include <vector>

#include "legopt/geometry/mesh.h"
#include "legopt/worldgen/building.h"
#include "legopt/worldgen/collapse.h"
#include "legopt/worldgen/fracture.h"

namespace legopt::worldgen {

/// One convex solid of a scenario, world frame; coordinates are representable as float.
struct Piece {  ///< vertices of the convex hull, m
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::vector<int>> faces;  ///< see Cell
  int member = -1;                      ///< index into Building::members
};

/// Returns the solids of a snapshot: undamaged members as a whole, and of the others every remaining cell at its
/// simulated pose. Cells more than `margin_m` outside the plan are omitted.
std::vector<Piece> PiecesOf(const Building& building, const std::vector<Cell>& cells, const Snapshot& snapshot,
                            double margin_m = 6.0);

/// Merges all pieces into one mesh: each is a closed surface with outward winding; faces are split into triangle fans.
/// Vertices of different pieces are separate. `piece_of_triangle` may be null.
TriangleMesh MeshOf(const std::vector<Piece>& pieces, std::vector<int>* piece_of_triangle = nullptr);

}  // namespace legopt::worldgen

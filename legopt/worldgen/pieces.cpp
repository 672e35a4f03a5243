#include "legopt/worldgen/pieces.h"

#include <Eigen/Geometry>
#include <utility>

namespace legopt::worldgen {
namespace {

using Eigen::Vector3d;

Piece PieceOf(const Cell& cell, const Eigen::Isometry3d& motion) {
  Piece piece{.vertices = {}, .faces = cell.faces, .member = cell.member};
  for (const Vector3d& vertex : cell.vertices) {
    // Rounded as in the mesh file, so that checks apply to the vertices that will be loaded.
    piece.vertices.emplace_back((motion * vertex).cast<float>().cast<double>());
  }
  return piece;
}

}  // namespace

std::vector<Piece> PiecesOf(const Building& building, const std::vector<Cell>& cells, const Snapshot& snapshot,
                            double margin_m) {
  std::vector<bool> whole(building.members.size(), true);
  for (size_t i = 0; i < cells.size(); ++i) {
    const CellState& state = snapshot.cells[i];
    if (state.moved || state.gone) whole[static_cast<size_t>(cells[i].member)] = false;
  }
  Eigen::AlignedBox2d world = building.plan;
  world.min().array() -= margin_m;
  world.max().array() += margin_m;
  std::vector<Piece> pieces;
  int last_whole = -1;
  for (size_t i = 0; i < cells.size(); ++i) {
    const CellState& state = snapshot.cells[i];
    const int member = cells[i].member;
    if (whole[static_cast<size_t>(member)]) {
      if (member == last_whole) continue;
      last_whole = member;
      const Cell cell = WholeCell(building.members[static_cast<size_t>(member)], member);
      pieces.push_back(PieceOf(cell, Eigen::Isometry3d::Identity()));
    } else if (!state.gone && world.contains(Eigen::Vector2d((state.motion * cells[i].centroid).head<2>()))) {
      pieces.push_back(PieceOf(cells[i], state.motion));
    }
  }
  return pieces;
}

TriangleMesh MeshOf(const std::vector<Piece>& pieces, std::vector<int>* piece_of_triangle) {
  TriangleMesh mesh;
  for (size_t p = 0; p < pieces.size(); ++p) {
    const int first = static_cast<int>(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(), pieces[p].vertices.begin(), pieces[p].vertices.end());
    for (const std::vector<int>& face : pieces[p].faces) {
      for (size_t k = 1; k + 1 < face.size(); ++k) {
        mesh.triangles.push_back({first + face[0], first + face[k], first + face[k + 1]});
        if (piece_of_triangle != nullptr) piece_of_triangle->push_back(static_cast<int>(p));
      }
    }
  }
  return mesh;
}

}  // namespace legopt::worldgen

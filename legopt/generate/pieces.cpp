#include "legopt/generate/pieces.h"

#include <Eigen/Geometry>
#include <bit>
#include <cstdint>
#include <fstream>
#include <utility>

#include "legopt/input_error.h"

namespace legopt {
namespace {

using Eigen::Vector3d;

Piece PieceOf(const Cell& cell, const Eigen::Isometry3d& motion) {
  Piece piece{.vertices = {}, .faces = cell.faces, .member = cell.member};
  for (const Vector3d& vertex : cell.vertices) {
    // As the mesh file has it: what is checked here is what will be loaded.
    piece.vertices.emplace_back((motion * vertex).cast<float>().cast<double>());
  }
  return piece;
}

template <class Number>
void Put(std::ofstream& stream, Number value) {
  static_assert(std::endian::native == std::endian::little, "PLY is written in the machine's order");
  stream.write(reinterpret_cast<const char*>(&value), sizeof(value));
}

/// Assimp takes line ends at the start of the data for a part of the header.
bool BeginsWithLineEnd(const TriangleMesh& mesh) {
  if (mesh.vertices.empty()) return false;
  const auto low_byte = std::bit_cast<std::uint32_t>(static_cast<float>(mesh.vertices.front().x())) & 0xFFU;
  return low_byte == '\n' || low_byte == '\r';
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

void WritePly(const std::filesystem::path& path, const TriangleMesh& mesh) {
  const bool guarded = BeginsWithLineEnd(mesh);
  std::ofstream stream(path, std::ios::binary);
  stream << "ply\nformat binary_little_endian 1.0\ncomment metres, z up\nelement vertex " << mesh.vertices.size()
         << (guarded ? "\nproperty uchar guard" : "")
         << "\nproperty float x\nproperty float y\nproperty float z\nelement face " << mesh.triangles.size()
         << "\nproperty list uchar int vertex_indices\nend_header\n";
  for (const Vector3d& vertex : mesh.vertices) {
    if (guarded) Put(stream, std::uint8_t{0});
    for (int axis = 0; axis < 3; ++axis) Put(stream, static_cast<float>(vertex[axis]));
  }
  for (const auto& triangle : mesh.triangles) {
    Put(stream, static_cast<std::uint8_t>(3));
    for (const int corner : triangle) Put(stream, static_cast<std::int32_t>(corner));
  }
  if (!stream.flush()) {
    throw InputError({path.string(), "", "", "cannot be written", "check the folder's permissions and free space"});
  }
}

}  // namespace legopt

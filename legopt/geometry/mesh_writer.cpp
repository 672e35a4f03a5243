#include "legopt/geometry/mesh_writer.h"

#include <bit>
#include <cstdint>

#include "legopt/files/output_file.h"
#include "legopt/types/classic_stream.h"

namespace legopt {
namespace {

using Eigen::Vector3d;

template <class Number>
void Put(std::ostream& stream, Number value) {
  static_assert(std::endian::native == std::endian::little, "PLY is written in the machine's order");
  stream.write(reinterpret_cast<const char*>(&value), sizeof(value));
}

/// Returns true if the data would begin with a line end, which assimp treats as part of the header.
bool BeginsWithLineEnd(const TriangleMesh& mesh) {
  if (mesh.vertices.empty()) return false;
  const auto low_byte = std::bit_cast<std::uint32_t>(static_cast<float>(mesh.vertices.front().x())) & 0xFFU;
  return low_byte == '\n' || low_byte == '\r';
}

}  // namespace

void WritePly(const std::filesystem::path& path, const TriangleMesh& mesh) {
  const bool guarded = BeginsWithLineEnd(mesh);
  ClassicOutput stream;
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
  WriteOutputFile(path, stream.view(), {files::kReadableByAll, files::Durability::kBuffered});
}

}  // namespace legopt

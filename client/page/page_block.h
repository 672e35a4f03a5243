#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "legopt/collision/mesh.h"

/// What of a page is not text: blocks of bytes, compressed by gzip and written as base64 (docs/page-data.md).
namespace legopt::client {

/// RFC 1952, without name and time, so that equal bytes give equal blocks. Throws std::bad_alloc alone.
std::string Gzip(const std::string& bytes);
/// RFC 4648, with padding.
std::string Base64(const std::string& bytes);

/// Waypoints as bytes: count and size (uint32 each), then by column the differences of consecutive values in units of
/// 1e-7 (rad, m), as int32 whose four bytes lie apart: first all lowest ones. A value is at most 0.5e-7 off. All
/// numbers are little-endian. Every waypoint has `size` numbers. Empty where a value is not finite or beyond 100, or
/// two of a column are more than 200 apart: PackExactly holds those.
std::string PackWaypoints(std::span<const Eigen::VectorXd> waypoints);
/// The same numbers as float64, row by row, behind the same head.
std::string PackExactly(std::span<const Eigen::VectorXd> waypoints);
/// What PackWaypoints was given, as a page reads it.
std::vector<Eigen::VectorXd> UnpackWaypoints(const std::string& bytes);

/// Where a mesh lies among the bytes of a GeometryBlock.
struct MeshRange {
  std::size_t vertices = 0, triangles = 0;          ///< how many
  std::size_t vertex_offset = 0, index_offset = 0;  ///< in bytes
};

/// Meshes behind each other: vertices as float32 x y z, m; triangles as three uint32.
class GeometryBlock {
 public:
  /// Returns its number, from 0.
  int Add(const TriangleMesh& mesh);
  const std::string& bytes() const { return bytes_; }               ///< of all
  const std::vector<MeshRange>& meshes() const { return meshes_; }  ///< in the order of Add

 private:
  std::string bytes_;
  std::vector<MeshRange> meshes_;
};

}  // namespace legopt::client

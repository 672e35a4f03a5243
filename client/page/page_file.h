#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "legopt/geometry/internal/mesh.h"

namespace legopt::client {

/// Binary data of a page: blocks of bytes, compressed by gzip and encoded as base64 (docs/reference/page-data.md).

/// Compresses bytes (RFC 1952), without name and time, so that equal bytes give equal blocks. Throws only
/// std::bad_alloc.
std::string Gzip(const std::string& bytes);
/// Encodes bytes (RFC 4648), with padding.
std::string Base64(const std::string& bytes);

/// Encodes waypoints: count and size (uint32 each), then column by column the differences of consecutive values in
/// units of 1e-7 (rad, m), as int32 split into four byte planes, lowest bytes first. The error of a value is at most
/// 0.5e-7. All numbers are little-endian. Every waypoint must have `size` numbers. Returns an empty string if a value
/// is not finite or beyond 100, or if consecutive values of a column differ by more than 200; use PackExactly then.
std::string PackWaypoints(std::span<const Eigen::VectorXd> waypoints);
/// Encodes the same numbers as float64, row by row, after the same header.
std::string PackExactly(std::span<const Eigen::VectorXd> waypoints);
/// Decodes the output of PackWaypoints, as the page does.
std::vector<Eigen::VectorXd> UnpackWaypoints(const std::string& bytes);

/// Position of a mesh in the bytes of a GeometryBlock.
struct MeshRange {
  std::size_t vertices = 0, triangles = 0;
  std::size_t vertex_offset = 0, index_offset = 0;  ///< offsets in bytes
};

/// Concatenated meshes: vertices as float32 x y z, m; triangles as three uint32.
class GeometryBlock {
 public:
  /// Appends a mesh; returns its index, starting at 0.
  int Add(const TriangleMesh& mesh);
  const std::string& bytes() const { return bytes_; }
  const std::vector<MeshRange>& meshes() const { return meshes_; }  ///< ordered by index

 private:
  std::string bytes_;
  std::vector<MeshRange> meshes_;
};

/// The JavaScript of the page, including styles: web/dist/page.js.
std::string_view PageProgram();
/// The JavaScript that reads files which a user opens: web/dist/opener.js.
std::string_view OpenerProgram();

/// Whether a page has OpenerProgram, and may run its WebAssembly.
enum class PageKind : std::uint8_t { kPlain, kOpener };

/// The HTML of a page whose script and blocks come from a server (`legopt serve`).
std::string LivePageText();

/// A self-contained HTML file: blocks, then the script. Its content security policy allows no requests.
class PageFile {
 public:
  /// `title`: window title.
  explicit PageFile(const std::string& title, PageKind kind = PageKind::kPlain);
  /// Adds a block of bytes; `name` may contain letters, digits and "-".
  void AddBlock(const std::string& name, const std::string& bytes);
  /// Adds a block with the text of a JSON value.
  void AddJson(const std::string& name, const nlohmann::ordered_json& json);
  std::size_t size() const;  ///< current size of the result of Finish in bytes
  /// Returns the text of the file.
  std::string Finish() const;

 private:
  std::string head_, blocks_;
  PageKind kind_;
};

}  // namespace legopt::client

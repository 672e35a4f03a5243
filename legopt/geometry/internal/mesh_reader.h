#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "legopt/geometry/internal/mesh.h"

namespace legopt {

/// Serializes the result of a guarded read (read_guard.h): a letter for the kind of answer, then sequences of trivially
/// copyable values, each preceded by its length. Writer and reader are the same program, so that values need no
/// conversion.
class ResultWriter {
 public:
  /// Starts an answer with the letter of its kind. The receiver removes this letter before it creates an ResultReader.
  explicit ResultWriter(char kind) : bytes_(1, kind) {}

  /// Appends the number of values (64 bits) and their bytes. `Sequence`: contiguous container of trivially copyable
  /// values.
  template <typename Sequence>
  void Add(const Sequence& values) {
    const std::uint64_t count = values.size();
    bytes_.append(reinterpret_cast<const char*>(&count), sizeof(count));
    bytes_.append(reinterpret_cast<const char*>(values.data()), count * sizeof(*values.data()));
  }

  std::string Take() { return std::move(bytes_); }  ///< returns the answer; the writer must not be used afterwards

 private:
  std::string bytes_;
};

/// Reads the sequences of an answer. The process that wrote the answer may have been corrupted, so lengths are checked
/// here, and callers must validate the values like any other input.
class ResultReader {
 public:
  /// `bytes`: the answer without its first letter; must outlive this object.
  explicit ResultReader(std::string_view bytes) : rest_(bytes) {}

  /// Reads the next sequence. Returns false if the rest of the answer does not contain a complete one.
  template <typename Sequence>
  bool Read(Sequence& values) {
    std::uint64_t count = 0;
    if (rest_.size() < sizeof(count)) return false;
    std::memcpy(&count, rest_.data(), sizeof(count));
    rest_.remove_prefix(sizeof(count));
    if (count > rest_.size() / sizeof(*values.data())) return false;
    values.resize(count);
    const std::size_t size = count * sizeof(*values.data());
    if (size > 0) std::memcpy(static_cast<void*>(values.data()), rest_.data(), size);
    rest_.remove_prefix(size);
    return true;
  }

  bool at_end() const {
    return rest_.empty();
  }  ///< true after the last sequence; a valid answer has no bytes left
     ///< over

 private:
  std::string_view rest_;
};

/// Limits of a mesh: collision needs no more, and several copies must fit into memory.
inline constexpr std::size_t kMaxMeshTriangles = 2'000'000;
inline constexpr std::uintmax_t kMaxMeshBytes = std::uintmax_t{256} << 20;  ///< largest size of a mesh file

/// Throws InputError for more than kMaxMeshTriangles triangles.
void CheckTriangleCount(const std::string& path, std::size_t triangles);

/// Converts an STL or OBJ file that assimp cannot read. STL: text with upper-case keywords becomes lower case, and
/// bytes after the last triangle of a binary file are removed. OBJ: coordinates such as ".5" get a digit before the
/// point. Empty if the file needs no change, and for other formats. Throws InputError for a binary STL whose number of
/// triangles does not match its size.
std::optional<std::string> RepairMeshText(const std::string& path);

/// Loads a mesh like LoadMesh, but without protection: assimp reads the file in the calling thread. Malformed files
/// make assimp 5.2 crash, write out of bounds or never return, so only LoadMesh calls this, under its guard.
TriangleMesh ReadMesh(const std::string& path, const Eigen::Vector3d& scale);

}  // namespace legopt

#include "legopt/geometry/mesh.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>

#include "legopt/geometry/isolated_result.h"
#include "legopt/geometry/mesh_file_check.h"
#include "legopt/geometry/mesh_reader.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"

namespace legopt {
namespace {

// Answer of the reading process: a mesh or the fault of the file, each as counted sequences.
constexpr char kMeshFollows = 'M';
constexpr char kFaultFollows = 'F';

std::string EncodeFault(const InputError::Fault& fault) {
  ResultWriter answer(kFaultFollows);
  for (const std::string* text : {&fault.file, &fault.field, &fault.value, &fault.message, &fault.fix}) {
    answer.Add(*text);
  }
  return answer.Take();
}

std::string EncodeMesh(const TriangleMesh& mesh) {
  ResultWriter answer(kMeshFollows);
  answer.Add(mesh.vertices);
  answer.Add(mesh.triangles);
  return answer.Take();
}

std::optional<InputError::Fault> DecodeFault(std::string_view bytes) {
  InputError::Fault fault;
  ResultReader answer(bytes);
  for (std::string* text : {&fault.file, &fault.field, &fault.value, &fault.message, &fault.fix}) {
    if (!answer.Read(*text)) return std::nullopt;
  }
  return answer.at_end() ? std::optional(fault) : std::nullopt;
}

std::optional<TriangleMesh> DecodeMesh(std::string_view bytes) {
  TriangleMesh mesh;
  ResultReader answer(bytes);
  if (!answer.Read(mesh.vertices) || !answer.Read(mesh.triangles) || !answer.at_end()) return std::nullopt;
  const int count = static_cast<int>(mesh.vertices.size());
  const auto in_range = [count](int index) { return index >= 0 && index < count; };
  for (const std::array<int, 3>& triangle : mesh.triangles) {
    if (!std::all_of(triangle.begin(), triangle.end(), in_range)) return std::nullopt;
  }
  for (const Eigen::Vector3d& vertex : mesh.vertices) {
    if (!vertex.allFinite()) return std::nullopt;
  }
  return mesh;
}

[[noreturn]] void RefuseUnread(const std::string& path, const std::string& reason) {
  throw InputError({path, "", "", "mesh cannot be read: " + reason, "export the mesh again or repair it"});
}

/// Limits for reading a mesh file: about seventy times the time and thirty times the memory that valid files need. OBJ
/// and DAE files of 35 MB are read at 30 MB/s, with 7 bytes of memory per byte.
ReadLimits LimitsFor(std::uintmax_t file_bytes) {
  constexpr std::uintmax_t kBytesPerCpuSecond = 500'000;
  constexpr std::int64_t kBytesPerByte = 200;
  constexpr std::int64_t kBaseBytes = std::int64_t{1} << 29;
  ReadLimits limits;
  limits.cpu_s = 5 + static_cast<int>(file_bytes / kBytesPerCpuSecond);
  limits.wall_s = 60 + 10 * limits.cpu_s;
  limits.memory_bytes = kBaseBytes + kBytesPerByte * static_cast<std::int64_t>(file_bytes);
  return limits;
}

}  // namespace

TriangleMesh LoadMesh(const std::string& path, const Eigen::Vector3d& scale, const ReadGuard& guard) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    throw InputError({path, "", "", "mesh file does not exist or is not a file", "check the path and mesh_folder"});
  }
  if (!scale.allFinite() || (scale.array() == 0.0).any()) {
    const std::string factors =
        FormatFixed(scale.x(), 6) + " " + FormatFixed(scale.y(), 6) + " " + FormatFixed(scale.z(), 6);
    throw InputError({path, "scale", factors, "mesh scale must be finite and not zero",
                      "give three factors such as 0.001 0.001 0.001"});
  }
  CheckMeshFile(path);
  if (!guard) return ReadMesh(path, scale);
  const auto read = [&path, &scale] {
    try {
      return EncodeMesh(ReadMesh(path, scale));
    } catch (const InputError& fault) {
      return EncodeFault(fault.fault());
    }
  };
  std::string answer;
  try {
    answer = guard(read, LimitsFor(std::filesystem::file_size(path, error)));
  } catch (const GuardedReadError& failure) {
    RefuseUnread(path, std::string("its reader failed: ") + failure.what());
  }
  const std::string_view content = answer;
  if (content.starts_with(kFaultFollows)) {
    if (std::optional<InputError::Fault> fault = DecodeFault(content.substr(1))) throw InputError(std::move(*fault));
  } else if (content.starts_with(kMeshFollows)) {
    if (std::optional<TriangleMesh> mesh = DecodeMesh(content.substr(1))) return std::move(*mesh);
  }
  RefuseUnread(path, "its reader gave no answer that makes sense");
}

}  // namespace legopt

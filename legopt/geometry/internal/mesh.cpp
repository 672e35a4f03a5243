#include "legopt/geometry/internal/mesh.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <numbers>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include "legopt/geometry/internal/height_map.h"
#include "legopt/geometry/internal/mesh_file.h"
#include "legopt/geometry/internal/mesh_reader.h"
#include "legopt/input/text.h"
#include "legopt/math/blake2b.h"
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
  answer.Add(std::array<int, 1>{mesh.degenerate_triangles});
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
  std::vector<int> degenerate_triangles;
  if (!answer.Read(mesh.vertices) || !answer.Read(mesh.triangles) || !answer.Read(degenerate_triangles) ||
      !answer.at_end() || degenerate_triangles.size() != 1) {
    return std::nullopt;
  }
  mesh.degenerate_triangles = degenerate_triangles.front();
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
  constexpr std::int64_t kBytesPerByte = 200;  // a height map: 2 x 24 bytes of triangles and 24 of a vertex per value
  constexpr std::int64_t kBaseBytes = std::int64_t{1} << 29;
  ReadLimits limits;
  limits.cpu_s = 5 + static_cast<int>(file_bytes / kBytesPerCpuSecond);
  limits.wall_s = 60 + 10 * limits.cpu_s;
  limits.memory_bytes = kBaseBytes + kBytesPerByte * static_cast<std::int64_t>(file_bytes);
  return limits;
}

/// Reads a mesh or a height map in the calling thread.
TriangleMesh ReadUnguarded(const std::string& path, const Eigen::Vector3d& scale) {
  return IsHeightMapFile(path) ? SolidBelow(ReadHeightGrid(path), scale) : ReadMesh(path, scale);
}

/// Hashes of files, computed again only if the size or the time of change differs: one command loads each mesh of a
/// robot several times. Thread-safe.
class FileHashes {
 public:
  std::string Of(const std::string& path) {
    using Clock = std::filesystem::file_time_type::clock;
    constexpr size_t kMaxFiles = 10'000;
    constexpr auto kSettled = std::chrono::seconds(1);  // later changes have another time, however coarse the clock
    std::error_code error;
    const std::string file = std::filesystem::absolute(path, error).string();
    const State state{std::filesystem::file_size(path, error), std::filesystem::last_write_time(path, error)};
    {
      const std::scoped_lock lock(mutex_);
      const auto found = files_.find(file);
      if (found != files_.end() && found->second.first == state) return found->second.second;
    }
    std::string hash = Blake2bHex(ReadFileText(path, kMaxMeshBytes));
    if (error || Clock::now() - state.changed < kSettled) return hash;
    const std::scoped_lock lock(mutex_);
    if (files_.size() >= kMaxFiles) files_.clear();
    files_.insert_or_assign(file, std::pair(state, hash));
    return hash;
  }

 private:
  struct State {
    std::uintmax_t bytes;
    std::filesystem::file_time_type changed;
    bool operator==(const State&) const = default;
  };

  std::mutex mutex_;
  std::map<std::string, std::pair<State, std::string>> files_;
};

std::string HashOfFile(const std::string& path) {
  static FileHashes hashes;
  return hashes.Of(path);
}

/// Returns the key of a mesh in a cache: the file's content and suffix, and the scale. Empty for glTF, whose files may
/// refer to others.
std::string KeyOf(const std::string& path, const Eigen::Vector3d& scale) {
  constexpr const char* kVersion = "legopt-mesh/2";
  const std::string suffix = std::filesystem::path(path).extension().string();
  if (suffix.size() < 2 || (suffix[1] | 0x20) == 'g') return "";
  ResultWriter key(kMeshFollows);
  key.Add(std::string(kVersion));
  key.Add(suffix);
  key.Add(std::array<double, 3>{scale.x(), scale.y(), scale.z()});
  key.Add(HashOfFile(path));
  return Blake2bHex(key.Take());
}

}  // namespace

TriangleMesh LoadMesh(const std::string& path, const Eigen::Vector3d& scale, const ReadGuard& guard) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    throw InputError({path, "", "", "mesh file does not exist or is not a file", "check the path and mesh_folder"});
  }
  if (const std::uintmax_t bytes = std::filesystem::file_size(path, error); !error && bytes > kMaxMeshBytes) {
    throw InputError({path, "size", std::to_string(bytes >> 20U) + " MiB",
                      "is more than " + std::to_string(kMaxMeshBytes >> 20U) + " MiB",
                      "simplify the mesh; collision needs far fewer triangles"});
  }
  if (!scale.allFinite() || (scale.array() == 0.0).any()) {
    const std::string factors =
        FormatFixed(scale.x(), 6) + " " + FormatFixed(scale.y(), 6) + " " + FormatFixed(scale.z(), 6);
    throw InputError({path, "scale", factors, "mesh scale must be finite and not zero",
                      "give three factors such as 0.001 0.001 0.001"});
  }
  const ByteCache* cache = guard.cache().get();
  const std::string key = cache == nullptr ? "" : KeyOf(path, scale);
  if (!key.empty()) {
    const std::optional<std::string> stored = cache->Read(key);
    if (stored && stored->starts_with(kMeshFollows)) {
      if (std::optional<TriangleMesh> mesh = DecodeMesh(std::string_view(*stored).substr(1))) return std::move(*mesh);
    }
  }
  if (!IsHeightMapFile(path)) CheckMeshFile(path);
  if (!guard) return ReadUnguarded(path, scale);
  const auto read = [&path, &scale] {
    try {
      return EncodeMesh(ReadUnguarded(path, scale));
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
    if (std::optional<TriangleMesh> mesh = DecodeMesh(content.substr(1))) {
      if (!key.empty()) cache->Write(key, answer);
      return std::move(*mesh);
    }
  }
  RefuseUnread(path, "its reader gave no answer that makes sense");
}

namespace {

constexpr int kSegments = 32;  // segments of a full turn; sagitta 0.5 % of the radius
constexpr int kRings = 16;     // rings from pole to pole of a sphere; even, so that a capsule can be split at the
                               // equator

void CheckSize(const ShapeSpec& shape, const char* kind, std::initializer_list<int> used) {
  for (int axis : used) {
    const double value = shape.size[axis];
    if (!(std::isfinite(value) && value > 0.0)) {
      throw InputError({"shape", std::string(kind) + " size", FormatFixed(value, 6), "size must be positive and finite",
                        "give metres, e.g. 0.1"});
    }
  }
}

TriangleMesh Box(const Eigen::Vector3d& size) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i) {
    mesh.vertices.emplace_back(0.5 *
                               size.cwiseProduct(Eigen::Vector3d(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1)));
  }
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

/// Returns a surface of revolution about z. The profile runs from low z to high z; its first and last points lie on the
/// axis.
TriangleMesh Revolve(const std::vector<Eigen::Vector2d>& profile) {
  TriangleMesh mesh;
  const int rings = static_cast<int>(profile.size()) - 2;
  mesh.vertices.emplace_back(0.0, 0.0, profile.front().y());
  for (int r = 1; r <= rings; ++r) {
    for (int s = 0; s < kSegments; ++s) {
      const double angle = 2.0 * std::numbers::pi * s / kSegments;
      const auto& [radius, z] = std::pair(profile[static_cast<size_t>(r)].x(), profile[static_cast<size_t>(r)].y());
      mesh.vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
    }
  }
  mesh.vertices.emplace_back(0.0, 0.0, profile.back().y());
  const int top = static_cast<int>(mesh.vertices.size()) - 1;
  const auto at = [](int ring, int s) { return 1 + ring * kSegments + s % kSegments; };
  for (int s = 0; s < kSegments; ++s) {
    mesh.triangles.push_back({0, at(0, s + 1), at(0, s)});
    for (int r = 0; r + 1 < rings; ++r) {
      mesh.triangles.push_back({at(r, s), at(r, s + 1), at(r + 1, s + 1)});
      mesh.triangles.push_back({at(r, s), at(r + 1, s + 1), at(r + 1, s)});
    }
    mesh.triangles.push_back({top, at(rings - 1, s), at(rings - 1, s + 1)});
  }
  return mesh;
}

/// Returns the profile of a sphere split at the equator, with its halves `length` apart.
std::vector<Eigen::Vector2d> CapsuleProfile(double radius, double length) {
  std::vector<Eigen::Vector2d> profile;
  for (int r = 0; r <= kRings; ++r) {
    const double angle = std::numbers::pi * r / kRings;
    const Eigen::Vector2d point(radius * std::sin(angle), -radius * std::cos(angle));
    const bool upper = 2 * r > kRings;
    if (2 * r == kRings && length > 0.0) {
      profile.emplace_back(radius, -0.5 * length);
      profile.emplace_back(radius, 0.5 * length);
    } else {
      profile.emplace_back(point.x(), point.y() + (upper ? 0.5 : -0.5) * length);
    }
  }
  return profile;
}

TriangleMesh InShapeFrame(const ShapeSpec& shape, const ReadGuard& guard) {
  switch (shape.kind) {
    case ShapeSpec::Kind::kBox:
      CheckSize(shape, "box", {0, 1, 2});
      return Box(shape.size);
    case ShapeSpec::Kind::kSphere:
      CheckSize(shape, "sphere", {0});
      return Revolve(CapsuleProfile(shape.size.x(), 0.0));
    case ShapeSpec::Kind::kCapsule:
      CheckSize(shape, "capsule", {0, 2});
      return Revolve(CapsuleProfile(shape.size.x(), shape.size.z()));
    case ShapeSpec::Kind::kCylinder: {
      CheckSize(shape, "cylinder", {0, 2});
      const double r = shape.size.x();
      const double h = 0.5 * shape.size.z();
      return Revolve({{0.0, -h}, {r, -h}, {r, h}, {0.0, h}});
    }
    case ShapeSpec::Kind::kMesh:
      return LoadMesh(shape.mesh_file, shape.scale, guard);
  }
  return {};
}

}  // namespace

TriangleMesh Tessellate(const ShapeSpec& shape, const ReadGuard& guard) {
  if (!shape.pose.matrix().allFinite()) {
    throw InputError({shape.mesh_file.empty() ? "shape" : shape.mesh_file, "pose", "", "pose is not finite",
                      "give finite position and rotation"});
  }
  TriangleMesh mesh = InShapeFrame(shape, guard);
  for (Eigen::Vector3d& vertex : mesh.vertices) vertex = shape.pose * vertex;
  return mesh;
}

}  // namespace legopt

#include "legopt/geometry/internal/mesh_reader.h"

#include <assimp/BaseImporter.h>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <bit>
#include <cctype>
#include <cstdint>
#include <cstring>
#include <exception>
#include <filesystem>
#include <memory>
#include <new>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "legopt/input/text.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"

namespace legopt {
namespace {

static_assert(std::endian::native == std::endian::little, "binary STL is little-endian");

constexpr std::size_t kHeader_bytes = 80, kTriangle_bytes = 50;

std::string LowerCaseOf(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::string SuffixOf(const std::string& path) { return LowerCaseOf(std::filesystem::path(path).extension().string()); }

/// Returns true for text of the form "solid ... facet ...", in upper or lower case. The header of a binary file may
/// contain these words, but a text contains no NUL.
bool IsTextStl(const std::string& content) {
  constexpr std::size_t kNameEnds_bytes = 4096;
  const std::string lower = LowerCaseOf(content.substr(0, kNameEnds_bytes));
  if (lower.find('\0') != std::string::npos) return false;
  const std::size_t first = lower.find_first_not_of(" \t\r\n");
  return first != std::string::npos && lower.compare(first, 5, "solid") == 0 &&
         lower.find("facet") != std::string::npos;
}

constexpr std::array<std::string_view, 4> kKeywords = {"solid", "facet", "loop", "vertex"};

std::size_t CountOf(std::string_view keyword, const std::string& content) {
  std::size_t count = 0;
  for (std::size_t at = content.find(keyword); at != std::string::npos; at = content.find(keyword, at + 1)) ++count;
  return count;
}

[[noreturn]] void RefuseCount(const std::string& path, std::uint64_t count, std::size_t bytes) {
  throw InputError({path, "number of triangles", std::to_string(count),
                    "does not fit the file, which has room for " +
                        std::to_string((bytes - kHeader_bytes - sizeof(std::uint32_t)) / kTriangle_bytes),
                    "export the mesh again; the file is cut off, or its header is wrong"});
}

}  // namespace

namespace {

/// Throws if a text STL ends within a facet or a word. A missing `endsolid` after a complete facet is tolerated.
void CheckEndOfTextStl(const std::string& path, const std::string& lower) {
  constexpr std::string_view kEndOfFacet = "endfacet", kSpace = " \t\r\n";
  const std::size_t last = lower.rfind(kEndOfFacet);
  const std::size_t from = last == std::string::npos ? 0 : last + kEndOfFacet.size();
  const std::size_t next = lower.find_first_not_of(kSpace, from);
  if (next == std::string::npos || lower.compare(next, 8, "endsolid") == 0) return;
  if (last == std::string::npos && lower.find("facet") == std::string::npos) return;  // the reader reports it
  if (last != std::string::npos && lower.compare(next, 5, "solid") == 0) return;      // a second, empty solid
  throw InputError({path, "text after the last facet", lower.substr(next, 40), "the file ends early",
                    "export or copy the mesh again"});
}

/// Returns an OBJ's text with a digit before each decimal point of its vertices; empty if it has them all. assimp skips
/// numbers such as ".5".
std::optional<std::string> WithLeadingZeros(const std::string& content) {
  std::string result;
  std::size_t copied = 0;
  bool vertex = false;
  for (std::size_t i = 0; i < content.size(); ++i) {
    const char previous = i == 0 ? '\n' : content[i - 1];
    if (previous == '\n' || previous == '\r')
      vertex = content.compare(i, 2, "v ") == 0 || content.compare(i, 2, "v\t") == 0;
    if (!vertex || content[i] != '.' || std::isdigit(static_cast<unsigned char>(previous)) != 0) continue;
    result.append(content, copied, i - copied) += '0';
    copied = i;
  }
  if (copied == 0) return std::nullopt;
  return result.append(content, copied);
}

}  // namespace

void CheckTriangleCount(const std::string& path, std::size_t triangles) {
  if (triangles <= kMaxMeshTriangles) return;
  throw InputError({path, "number of triangles", std::to_string(triangles),
                    "is more than " + std::to_string(kMaxMeshTriangles),
                    "simplify the mesh; collision needs far fewer triangles"});
}

std::optional<std::string> RepairMeshText(const std::string& path) {
  const std::string suffix = SuffixOf(path);
  if (suffix == ".obj") return WithLeadingZeros(ReadFileText(path, kMaxMeshBytes));
  if (suffix != ".stl") return std::nullopt;
  std::string content = ReadFileText(path, kMaxMeshBytes);
  if (IsTextStl(content)) {
    std::string lower = LowerCaseOf(content);
    CheckEndOfTextStl(path, lower);
    const bool as_expected = std::ranges::all_of(
        kKeywords, [&](std::string_view keyword) { return CountOf(keyword, content) == CountOf(keyword, lower); });
    return as_expected ? std::nullopt : std::optional(std::move(lower));
  }
  if (content.size() < kHeader_bytes + sizeof(std::uint32_t)) return std::nullopt;
  std::uint32_t count = 0;
  std::memcpy(&count, content.data() + kHeader_bytes, sizeof(count));
  const std::size_t start = kHeader_bytes + sizeof(count), needed = start + std::size_t{count} * kTriangle_bytes;
  if (needed <= content.size()) CheckTriangleCount(path, count);
  if (count == 0 || needed == content.size()) return std::nullopt;
  // Complete triangles after the last one are not trailing bytes: the header must be wrong.
  if (needed > content.size() || content.size() - needed >= kTriangle_bytes) RefuseCount(path, count, content.size());
  content.resize(needed);
  return content;
}

namespace {

[[noreturn]] void Refuse(const std::string& path, const std::string& field, const std::string& value,
                         const std::string& message, const std::string& fix) {
  throw InputError({path, field, value, message, fix});
}

constexpr const char* kExportAgain = "export the mesh again or repair it";

/// Removes all other readers: assimp also tries every format whose mark it finds in the file. They are never needed and
/// increase the attack surface.
void UnregisterUnusedReaders(Assimp::Importer& importer) {
  std::vector<Assimp::BaseImporter*> others;
  for (std::size_t i = 0; i < importer.GetImporterCount(); ++i) {
    std::set<std::string> suffixes;
    importer.GetImporter(i)->GetExtensionList(suffixes);
    bool needed = std::any_of(suffixes.begin(), suffixes.end(), [](const std::string& suffix) {
      return suffix == "stl" || suffix == "obj" || suffix == "dae" || suffix == "ply" || suffix == "off";
    });
    const aiImporterDesc* about = importer.GetImporter(i)->GetInfo();
    const std::string_view name = about != nullptr && about->mName != nullptr ? about->mName : "";
    needed = needed || name.starts_with("glTF2");  // glTF 1 has the same suffixes
    if (!needed) others.push_back(importer.GetImporter(i));
  }
  for (Assimp::BaseImporter* reader : others) {
    const std::unique_ptr<Assimp::BaseImporter> ours(reader);  // owned here: an unregistered reader no longer belongs
                                                               // to the importer
    importer.UnregisterLoader(reader);
  }
}

/// Splits polygons into triangles. Assimp's own step does not validate its input: it reads vertices at unchecked
/// indices, and aborts if the declared types of faces are wrong. So both are checked first, and a mesh without polygons
/// is not changed.
const aiScene* Triangulate(Assimp::Importer& importer, const std::string& path) {
  bool has_polygons = false;
  const aiScene& scene = *importer.GetScene();
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    aiMesh& mesh = *scene.mMeshes[m];
    mesh.mPrimitiveTypes &= ~static_cast<unsigned>(aiPrimitiveType_POLYGON);
    for (unsigned i = 0; i < mesh.mNumFaces; ++i) {
      const aiFace& face = mesh.mFaces[i];
      for (unsigned corner = 0; corner < face.mNumIndices; ++corner) {
        if (face.mIndices[corner] >= mesh.mNumVertices) {
          Refuse(path, "face " + std::to_string(i), std::to_string(face.mIndices[corner]), "there is no such vertex",
                 kExportAgain);
        }
      }
      if (face.mNumIndices > 3) mesh.mPrimitiveTypes |= aiPrimitiveType_POLYGON;
    }
    has_polygons = has_polygons || (mesh.mPrimitiveTypes & aiPrimitiveType_POLYGON) != 0;
  }
  return has_polygons ? importer.ApplyPostProcessing(aiProcess_Triangulate) : &scene;
}

/// Exact coordinates as a hash key; -0.0 and 0.0 are equal.
struct VertexKey {
  std::array<double, 3> xyz;
  bool operator==(const VertexKey& other) const { return xyz == other.xyz; }
};

struct VertexHash {
  std::size_t operator()(const VertexKey& key) const {
    std::uint64_t hash = 0x9E3779B97F4A7C15ULL;
    for (double c : key.xyz) {
      std::uint64_t bits = 0;
      std::memcpy(&bits, &c, sizeof(bits));
      hash = (hash ^ bits) * 0xFF51AFD7ED558CCDULL;
      hash ^= hash >> 32;
    }
    return hash;
  }
};

/// Collects triangles of the file's nodes in order and welds their vertices.
class MeshBuilder {
 public:
  MeshBuilder(const std::string& path, const Eigen::Vector3d& scale)
      : path_(path), scale_(scale), mirrored_(scale.prod() < 0.0) {}

  void AddNode(const aiScene& scene, const aiNode& node, const aiMatrix4x4& parent, int depth = 0) {
    constexpr int kMaxDepth = 100;
    if (depth > kMaxDepth) Refuse(path_, "node", node.mName.C_Str(), "is nested too deeply", kExportAgain);
    const aiMatrix4x4 transform = parent * node.mTransformation;
    for (unsigned i = 0; i < node.mNumMeshes; ++i) {
      if (node.mMeshes[i] >= scene.mNumMeshes) Refuse(path_, "node", node.mName.C_Str(), "has no mesh", kExportAgain);
      AddMesh(*scene.mMeshes[node.mMeshes[i]], transform);
    }
    for (unsigned i = 0; i < node.mNumChildren; ++i) AddNode(scene, *node.mChildren[i], transform, depth + 1);
  }

  TriangleMesh Take() { return std::move(mesh_); }

 private:
  void AddMesh(const aiMesh& source, const aiMatrix4x4& transform) {
    std::vector<int> index(source.mNumVertices);
    for (unsigned i = 0; i < source.mNumVertices; ++i) index[i] = AddVertex(transform * source.mVertices[i]);
    const bool flip = mirrored_ != (transform.Determinant() < 0.0F);
    for (unsigned i = 0; i < source.mNumFaces; ++i) {
      const aiFace& face = source.mFaces[i];
      if (face.mNumIndices != 3) continue;  // points and lines
      std::array<int, 3> triangle = {index[face.mIndices[0]], index[face.mIndices[1]], index[face.mIndices[2]]};
      if (flip) std::swap(triangle[1], triangle[2]);
      if (triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0]) {
        ++mesh_.degenerate_triangles;
        continue;
      }
      mesh_.triangles.push_back(triangle);
    }
  }

  int AddVertex(const aiVector3D& v) {
    const Eigen::Vector3d point = scale_.cwiseProduct(Eigen::Vector3d(v.x, v.y, v.z));
    if (!point.allFinite()) {
      Refuse(path_, "vertex", FormatFixed(v.x, 6) + " " + FormatFixed(v.y, 6) + " " + FormatFixed(v.z, 6),
             "coordinate is not a finite number", kExportAgain);
    }
    const VertexKey key{{point.x() + 0.0, point.y() + 0.0, point.z() + 0.0}};
    const auto [it, inserted] = index_.try_emplace(key, static_cast<int>(mesh_.vertices.size()));
    if (inserted) mesh_.vertices.push_back(point);
    return it->second;
  }

  const std::string& path_;
  const Eigen::Vector3d scale_;
  const bool mirrored_;
  TriangleMesh mesh_;
  std::unordered_map<VertexKey, int, VertexHash> index_;
};

// Rethrows bad_alloc: assimp catches all exceptions of its readers, but lack of memory is not a fault of the file.
void RethrowBadAlloc(const Assimp::Importer& importer) {
  if (importer.GetException() == nullptr) return;
  try {
    std::rethrow_exception(importer.GetException());
  } catch (const std::bad_alloc&) {
    throw;
  } catch (...) {  // a fault of the file, which GetErrorString describes
  }
}

constexpr const char* kFormats = "give an STL, OBJ, DAE, PLY, glTF 2 or OFF file with triangles";

}  // namespace

TriangleMesh ReadMesh(const std::string& path, const Eigen::Vector3d& scale) {
  const ClassicNumericLocale point;
  Assimp::Importer importer;
  UnregisterUnusedReaders(importer);
  // Vertices keep the file's axes, and units are converted to metres. mesh_file.h rotates scenes.
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  const aiScene* scene = nullptr;
  std::string reason;
  try {
    const std::optional<std::string> repaired = RepairMeshText(path);
    scene = repaired ? importer.ReadFileFromMemory(repaired->data(), repaired->size(), 0, SuffixOf(path).c_str() + 1)
                     : importer.ReadFile(path, 0);
    if (scene != nullptr) scene = Triangulate(importer, path);
    if (scene == nullptr) RethrowBadAlloc(importer);
    reason = importer.GetErrorString();
  } catch (const InputError&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& e) {  // assimp does not catch all exceptions on malformed files
    scene = nullptr;
    reason = e.what();
  }
  if (scene == nullptr || scene->mRootNode == nullptr) {
    Refuse(path, "", "", "mesh cannot be read: " + (reason.empty() ? "unknown fault" : reason), kFormats);
  }
  MeshBuilder builder(path, scale);
  builder.AddNode(*scene, *scene->mRootNode, aiMatrix4x4());
  TriangleMesh mesh = builder.Take();
  if (mesh.triangles.empty()) Refuse(path, "", "", "mesh has no triangles", kFormats);
  CheckTriangleCount(path, mesh.triangles.size());
  return mesh;
}

}  // namespace legopt

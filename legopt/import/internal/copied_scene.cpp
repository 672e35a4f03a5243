#include "legopt/import/internal/copied_scene.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <utility>

#include "legopt/dataset/internal/text_file.h"
#include "legopt/dataset/scene_file.h"
#include "legopt/files/written_file.h"
#include "legopt/geometry/internal/height_map.h"
#include "legopt/geometry/internal/mesh_bodies.h"
#include "legopt/geometry/internal/mesh_file.h"
#include "legopt/import/internal/copied_robot.h"
#include "legopt/import/internal/sdf_world.h"
#include "legopt/input/text.h"
#include "legopt/input/yaml.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;
using Severity = DatasetDiagnostic::Severity;

constexpr const char* kSceneFolder = "scene";
constexpr double kNearlyClosedShare = 0.01;  // share of open edges up to which the check of the dataset only warns

std::string Lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

class SceneCopy {
 public:
  SceneCopy(const fs::path& scene, const fs::path& folder, const SceneCopyOptions& options)
      : scene_(scene), folder_(folder), options_(options) {}

  CopiedScene Make() {
    if (options_.repair.any() || NeedsRebuilding(scene_)) {
      Rebuild();
      return std::move(copied_);
    }
    const Scene source = ReadSceneFile(scene_, options_.read_guard);
    if (IsMeshFile(scene_)) {
      CopyOneMesh();
    } else {
      CopyObjects(source);
    }
    return std::move(copied_);
  }

 private:
  /// Returns true for formats that a dataset does not contain, since they refer to files that it does not list.
  static bool NeedsRebuilding(const fs::path& scene) { return IsGltf(scene.string()) || IsSdfFile(scene); }

  void Rebuild() {
    SceneRepairOptions options = options_.repair;
    options.read_guard = options_.read_guard;
    RebuiltScene scene = RebuildScene(scene_, options);
    const bool one_mesh = IsMeshFile(scene_);
    copied_.file = one_mesh ? "scene.ply" : (fs::path(kSceneFolder) / "scene.yaml").generic_string();
    MakeFolder((folder_ / copied_.file).parent_path());
    if (one_mesh) {
      WriteSceneMesh(scene, folder_ / copied_.file);
    } else {
      WriteSceneYaml(scene, folder_ / copied_.file, "meshes");
    }
    copied_.findings = std::move(scene.notes);
    for (const RebuiltObject& object : scene.objects) {
      if (!options.repair || !object.mesh) continue;
      const MeshRepairCounts& counts = object.mesh->counts;
      copied_.findings.push_back({.severity = counts.none() ? Severity::kInfo : Severity::kRepaired,
                                  .check = "repair",
                                  .file = copied_.file,
                                  .field = object.object.name,
                                  .value = ToString(counts),
                                  .message = FormatGeneral(object.mesh->volume_m3, 6) + " m3 enclosed",
                                  .fix = ""});
    }
    copied_.objects = std::move(scene.objects);
  }

  void CopyOneMesh() {
    copied_.file = "scene.ply";
    if (WriteTurnedMesh(scene_, copied_.file)) return;
    copied_.file = "scene" + Lower(scene_.extension().string());
    CopyOutputFile(scene_, folder_ / copied_.file);
  }

  void CopyObjects(const Scene& source) {
    copied_.file = (fs::path(kSceneFolder) / scene_.filename()).generic_string();
    std::map<fs::path, fs::path> turned;  // paths relative to the scene's folder
    for (const SceneObject& object : source.objects) {
      if (object.shape.kind == ShapeSpec::Kind::kMesh) CopyMeshOf(object, &turned);
    }
    if (turned.empty()) {
      CopyOutputFile(scene_, folder_ / copied_.file);
    } else {
      WriteTextFile(folder_ / copied_.file, WithMeshes(turned));
    }
  }

  void CopyMeshOf(const SceneObject& object, std::map<fs::path, fs::path>* turned) {
    const fs::path relative = fs::path(object.shape.mesh_file).lexically_relative(scene_.parent_path());
    if (relative.empty() || *relative.begin() == "..") {
      throw InputError({scene_.string(), "object '" + object.name + "': file", object.shape.mesh_file,
                        "the mesh lies outside of the scene's folder", "move it beside the scene file"});
    }
    if (turned->contains(relative)) return;
    const fs::path replacement = FreeName(relative);
    const bool is_mesh = !IsHeightMapFile(object.shape.mesh_file);
    if (is_mesh && WriteTurnedMesh(object.shape.mesh_file, kSceneFolder / replacement)) {
      turned->emplace(relative, replacement);
    } else {
      CopyOutputFile(object.shape.mesh_file, folder_ / kSceneFolder / relative);
    }
  }

  fs::path FreeName(fs::path mesh) const {
    do {
      mesh.replace_filename(mesh.stem().string() + "-turned.ply");
    } while (fs::exists(scene_.parent_path() / mesh) || fs::exists(folder_ / kSceneFolder / mesh));
    return mesh;
  }

  /// Writes a mesh, z up, that needs a repair which adds no surface. Returns false without writing if it needs none, or
  /// if its faults remain: then the check of the dataset reports them.
  bool WriteTurnedMesh(const fs::path& mesh_file, const fs::path& to) {
    TriangleMesh mesh = LoadMesh(mesh_file.string(), Eigen::Vector3d::Ones(), options_.read_guard);
    const MeshFaults faults = FindMeshFaults(mesh);
    const bool duplicates = CountDuplicates(mesh) > 0;
    const bool gltf = IsGltf(mesh_file.string());
    if (!duplicates && !gltf && !IsUnusable(faults, 0)) return false;
    RepairedMesh repaired = RepairMesh(mesh, {.close = false});
    const bool better = !IsUnusable(repaired.faults, repaired.counts.cavities) &&
                        repaired.faults.open_edges <= faults.open_edges && !repaired.counts.none();
    if (!better && !gltf) return false;
    if (better) mesh = std::move(repaired.mesh);
    const Eigen::Matrix3d turn = RotationToZUp(mesh_file.string());  // PLY files have no up axis
    for (Eigen::Vector3d& vertex : mesh.vertices) vertex = turn * vertex;
    MakeFolder((folder_ / to).parent_path());
    WritePly(folder_ / to, mesh);
    if (better) NoteRepair(mesh_file, to, repaired.counts);
    return true;
  }

  /// Returns true for faults with which the check of the dataset fails.
  static bool IsUnusable(const MeshFaults& faults, int cavities) {
    return faults.inverted_components > cavities || faults.open_edges > kNearlyClosedShare * faults.edges;
  }

  void NoteRepair(const fs::path& mesh_file, const fs::path& to, const MeshRepairCounts& counts) {
    const int turned = counts.turned_bodies;
    const std::string file = mesh_file.lexically_relative(fs::weakly_canonical(options_.root)).generic_string();
    const std::string written = "; the mesh is written as " + to.filename().string();
    MeshRepairCounts others = counts;
    others.turned_bodies = 0;
    if (turned > 0) {
      copied_.findings.push_back({.severity = Severity::kRepaired,
                                  .check = "winding",
                                  .file = "",
                                  .field = file,
                                  .value = std::to_string(turned) + (turned == 1 ? " body" : " bodies"),
                                  .message = "wound inside out, turned round" + written,
                                  .fix = ""});
      others.turned_triangles = 0;
    }
    if (others.none()) return;
    copied_.findings.push_back({.severity = others.duplicate_triangles > 0 ? Severity::kWarning : Severity::kRepaired,
                                .check = "repair",
                                .file = "",
                                .field = file,
                                .value = ToString(others),
                                .message = "no surface was added" + written,
                                .fix = ""});
  }

  /// Returns the text of the scene file with replaced mesh names; the rest, including comments, is unchanged.
  std::string WithMeshes(const std::map<fs::path, fs::path>& meshes) const {
    std::string text = ReadFileText(scene_, YamlLimits{}.bytes);
    if (text.starts_with("\xEF\xBB\xBF")) text.erase(0, 3);  // positions do not count the byte order mark
    const YAML::Node objects = ParseYaml(text, scene_.string())["objects"];
    for (std::size_t i = objects.size(); i-- > 0;) {  // backwards, so that earlier positions stay valid
      const YAML::Node file = objects[i]["file"];
      if (!file) continue;
      const auto found = meshes.find(fs::path(file.Scalar()).lexically_normal());
      if (found != meshes.end()) ReplaceScalar(file, found->second.generic_string(), &text);
    }
    return text;
  }

  void ReplaceScalar(const YAML::Node& node, const std::string& value, std::string* text) const {
    const auto at = static_cast<std::size_t>(std::max(0, node.Mark().pos));
    for (const char* quote : {"", "'", "\""}) {
      const std::string written = quote + node.Scalar() + quote;
      if (text->compare(at, written.size(), written) != 0) continue;
      text->replace(at, written.size(), "'" + value + "'");
      return;
    }
    throw InputError({scene_.string(), "file", node.Scalar(), "its mesh is to be replaced, and the name is not found",
                      "write it as a plain or quoted word on the line of its key"});
  }

  const fs::path& scene_;
  const fs::path& folder_;
  const SceneCopyOptions& options_;
  CopiedScene copied_;
};

}  // namespace

CopiedScene CopySceneFiles(const fs::path& scene, const fs::path& folder, const SceneCopyOptions& options) {
  return SceneCopy(scene, folder, options).Make();
}

}  // namespace legopt

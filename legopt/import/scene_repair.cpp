#include "legopt/import/scene_repair.h"

#include <cctype>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <system_error>

#include "legopt/dataset/internal/text_file.h"
#include "legopt/dataset/scene_file.h"
#include "legopt/geometry/internal/mesh_file.h"
#include "legopt/import/internal/copied_robot.h"
#include "legopt/import/internal/sdf_world.h"
#include "legopt/input/json.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;
using Severity = DatasetDiagnostic::Severity;

DatasetDiagnostic NoteOf(Severity severity, const std::string& check, const std::string& field,
                         const std::string& value, const std::string& message, const std::string& fix = "") {
  return {
      .severity = severity, .check = check, .file = "", .field = field, .value = value, .message = message, .fix = fix};
}

class SceneBuilder {
 public:
  SceneBuilder(const fs::path& path, const SceneRepairOptions& options) : path_(path), options_(options) {}

  RebuiltScene Build() {
    options_.Validate();
    Scene scene =
        IsSdfFile(path_) ? ReadSdfWorld(path_, options_.read_guard) : ReadSceneFile(path_, options_.read_guard);
    if (!options_.up.empty() && !IsMeshFile(path_)) {
      throw InputError({path_.string(), "--up", options_.up, "is for a mesh file; the axes of this format are fixed",
                        "leave it out, and give the objects of a scene.yaml an rpy"});
    }
    if (IsMeshFile(path_)) ApplyUp(&scene.objects.front().shape);
    for (const SceneObject& object : scene.objects) Add(object);
    if (options_.scale) {
      built_.notes.push_back(NoteOf(Severity::kInfo, "scale", "scene", FormatGeneral(*options_.scale, 6),
                                    "all lengths are multiplied by this factor"));
    }
    return std::move(built_);
  }

 private:
  /// Replaces the rotation from the file's up axis by the requested one.
  void ApplyUp(ShapeSpec* shape) {
    Eigen::Matrix3d turn = shape->pose.linear();
    const bool by_file = !turn.isIdentity();
    if (!options_.up.empty()) {
      turn = options_.up == "y" ? Eigen::Matrix3d{{1, 0, 0}, {0, 0, -1}, {0, 1, 0}} : Eigen::Matrix3d::Identity();
      shape->pose.linear() = turn;
    }
    if (turn.isIdentity()) return;
    built_.notes.push_back(NoteOf(Severity::kInfo, "up axis", "scene", path_.filename().string(),
                                  options_.up.empty() || !by_file
                                      ? "another axis than z points up: the mesh is turned so that z does"
                                      : "the mesh is turned as --up says"));
  }

  void Add(const SceneObject& source) {
    RebuiltObject& target = built_.objects.emplace_back();
    target.object = source;
    const double scale = options_.scale.value_or(1.0);
    ShapeSpec& shape = target.object.shape;
    if (shape.kind != ShapeSpec::Kind::kMesh) {
      shape.size *= scale;
      shape.pose.translation() *= scale;
      return;
    }
    TriangleMesh mesh;
    try {
      mesh = Tessellate(shape, options_.read_guard);
    } catch (const InputError& error) {
      std::vector<InputError::Fault> faults = error.faults();
      for (InputError::Fault& fault : faults) {
        fault.field = "scene object '" + source.name + "'" + (fault.field.empty() ? "" : ": " + fault.field);
      }
      throw InputError::Of(std::move(faults));
    }
    for (Eigen::Vector3d& vertex : mesh.vertices) vertex *= scale;
    shape = {};
    if (options_.repair) {
      target.mesh = RepairMesh(mesh, options_.mesh);
    } else {
      target.mesh = RepairedMesh{};
      target.mesh->origins.resize(mesh.triangles.size(), TriangleOrigin::kKept);
      target.mesh->mesh = std::move(mesh);
      target.mesh->faults = FindMeshFaults(target.mesh->mesh);
      target.mesh->volume_m3 = EnclosedVolume(target.mesh->mesh);
    }
  }

  const fs::path& path_;
  const SceneRepairOptions& options_;
  RebuiltScene built_;
};

/// Returns a file name for an object that no earlier object has.
std::string MeshNameFor(const std::string& name, std::set<std::string>* taken) {
  std::string plain;
  for (const unsigned char c : name) {
    plain += std::isalnum(c) != 0 || c == '_' || c == '-' ? static_cast<char>(std::tolower(c)) : '_';
  }
  constexpr std::size_t kMaxLength = 100;
  plain = plain.empty() ? "mesh" : plain.substr(0, kMaxLength);
  std::string file = plain + ".ply";
  for (int k = 2; !taken->insert(file).second; ++k) file = plain + "-" + std::to_string(k) + ".ply";
  return file;
}

}  // namespace

void SceneRepairOptions::Validate() const {
  mesh.Validate();
  if (scale && !(std::isfinite(*scale) && *scale > 0.0)) {
    throw InputError(
        {"", "--scale", FormatGeneral(*scale, 6), "must be greater than 0", "e.g. 0.001 for a scene in millimetres"});
  }
  if (!up.empty() && up != "y" && up != "z") {
    throw InputError({"", "--up", up, "is no axis that can point up", "give y or z"});
  }
}

MeshRepairCounts RebuiltScene::Counts() const {
  MeshRepairCounts sum;
  for (const RebuiltObject& object : objects) {
    if (object.mesh) sum.Add(object.mesh->counts);
  }
  return sum;
}

double RebuiltScene::Volume_m3() const {
  double sum = 0.0;
  for (const RebuiltObject& object : objects) {
    sum += object.mesh ? object.mesh->volume_m3 : EnclosedVolume(Tessellate(object.object.shape));
  }
  return sum;
}

RebuiltScene RebuildScene(const fs::path& path, const SceneRepairOptions& options) {
  return SceneBuilder(path, options).Build();
}

std::vector<DatasetDiagnostic> FaultsOf(const RebuiltScene& scene) {
  std::vector<DatasetDiagnostic> findings;
  for (const RebuiltObject& object : scene.objects) {
    if (!object.mesh || object.mesh->faults.open_edges == 0) continue;
    const MeshFaults& faults = object.mesh->faults;
    findings.push_back(NoteOf(Severity::kError, "holes", object.object.name,
                              std::to_string(faults.open_edges) + " of " + std::to_string(faults.edges) +
                                  " edges, in " + std::to_string(faults.open_components) + " of " +
                                  std::to_string(faults.components) + " bodies",
                              "are still open: their outline is not planar, or faces cross each other there",
                              "raise --weld if the gaps are wider than it, or close these in a modelling program"));
  }
  return findings;
}

void WriteSceneYaml(const RebuiltScene& scene, const fs::path& file, const std::string& mesh_folder) {
  std::string text = "objects:\n";
  std::set<std::string> taken;
  for (const RebuiltObject& object : scene.objects) {
    text += "  - {name: " + Dump(nlohmann::json(object.object.name)) + ", shape: ";
    if (object.mesh) {
      const fs::path mesh = fs::path(mesh_folder) / MeshNameFor(object.object.name, &taken);
      std::error_code error;
      fs::create_directories((file.parent_path() / mesh).parent_path(), error);
      if (error) {
        throw InputError({(file.parent_path() / mesh_folder).string(), "", "", "cannot be made: " + error.message(),
                          "check permissions and free space"});
      }
      WritePly(file.parent_path() / mesh, object.mesh->mesh);
      text += "mesh, file: " + Dump(nlohmann::json(mesh.generic_string())) + "}\n";
    } else {
      text += FormatPrimitive(object.object.shape) + "}\n";
    }
  }
  WriteTextFile(file, text);
}

void WriteSceneMesh(const RebuiltScene& scene, const fs::path& file) {
  TriangleMesh all;
  for (const RebuiltObject& object : scene.objects) {
    const TriangleMesh mesh = object.mesh ? object.mesh->mesh : Tessellate(object.object.shape);
    const int first = static_cast<int>(all.vertices.size());
    all.vertices.insert(all.vertices.end(), mesh.vertices.begin(), mesh.vertices.end());
    for (const auto& [a, b, c] : mesh.triangles) all.triangles.push_back({first + a, first + b, first + c});
  }
  WritePly(file, all);
}

}  // namespace legopt

#include "legopt/import/scene_files.h"

#include <algorithm>
#include <cctype>
#include <map>

#include "legopt/dataset/scene_file.h"
#include "legopt/dataset/text_file.h"
#include "legopt/files/output_file.h"
#include "legopt/geometry/collada_up_axis.h"
#include "legopt/geometry/mesh_faults.h"
#include "legopt/geometry/mesh_writer.h"
#include "legopt/input/file_text.h"
#include "legopt/input/yaml.h"
#include "legopt/types/input_error.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSceneFolder = "scene";

std::string Lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

class SceneCopy {
 public:
  SceneCopy(const fs::path& scene, const fs::path& folder, const SceneCopyOptions& options)
      : scene_(scene), folder_(folder), options_(options) {}

  CopiedScene Make() {
    const Scene source = ReadSceneFile(scene_, options_.read_guard);
    if (IsMeshFile(scene_)) {
      CopyOneMesh();
    } else {
      CopyObjects(source);
    }
    return std::move(copied_);
  }

 private:
  void CopyOneMesh() {
    copied_.file = "scene.ply";
    if (options_.fix_winding && WriteFlippedMesh(scene_, copied_.file)) return;
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
    if (options_.fix_winding && WriteFlippedMesh(object.shape.mesh_file, kSceneFolder / replacement)) {
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

  /// Writes a mesh with outward winding of all bodies and z up. Returns false without writing if no body is inverted.
  bool WriteFlippedMesh(const fs::path& mesh_file, const fs::path& to) {
    TriangleMesh mesh = LoadMesh(mesh_file.string(), Eigen::Vector3d::Ones(), options_.read_guard);
    const int inverted = FindMeshFaults(mesh).inverted_components;
    if (inverted == 0) return false;
    const Eigen::Matrix3d turn = RotationToZUp(mesh_file.string());  // PLY files have no up axis
    for (Eigen::Vector3d& vertex : mesh.vertices) vertex = turn * vertex;
    fs::create_directories((folder_ / to).parent_path());
    WritePly(folder_ / to, FlipInvertedComponents(mesh));
    copied_.findings.push_back(
        {.severity = DatasetDiagnostic::Severity::kInfo,
         .check = "winding",
         .file = "",
         .field = mesh_file.lexically_relative(fs::weakly_canonical(options_.root)).generic_string(),
         .value = std::to_string(inverted) + (inverted == 1 ? " body" : " bodies"),
         .message = "wound inside out, turned round; the mesh is written as " + to.filename().string(),
         .fix = ""});
    return true;
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

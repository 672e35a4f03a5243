#include "legopt/dataset/scene_file.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "legopt/dataset/internal/yaml_fields.h"
#include "legopt/geometry/internal/mesh_file.h"
#include "legopt/input/yaml.h"
#include "legopt/types/nearest_name.h"
#include "legopt/types/number_text.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> KnownKeys(const std::string& shape) {
  std::vector<std::string> keys = {"name", "shape", "position", "rpy"};
  if (shape == "box") keys.insert(keys.end(), {"size"});
  if (shape == "sphere") keys.insert(keys.end(), {"radius"});
  if (shape == "cylinder" || shape == "capsule") keys.insert(keys.end(), {"radius", "length"});
  if (shape == "mesh") keys.insert(keys.end(), {"file", "scale"});
  return keys;
}

std::string ReadShapeName(const YAML::Node& node, const std::string& file, const std::string& place) {
  const std::vector<std::string> shapes = {"box", "sphere", "cylinder", "capsule", "mesh"};
  // Only `shape` is read here; the other keys depend on it and are checked later.
  YAML::Node head(YAML::NodeType::Map);
  if (node.IsMap() && node["shape"]) head["shape"] = node["shape"];
  const YamlFields fields(node.IsMap() ? head : node, file, place, {"shape"});
  const std::string shape = fields.RequireText("shape");
  if (std::find(shapes.begin(), shapes.end(), shape) == shapes.end()) {
    fields.Fail("shape", shape, "unknown shape", SuggestName(shape, shapes));
  }
  return shape;
}

double RequirePositive(const YamlFields& fields, const std::string& key) {
  const double value = fields.RequireNumber(key);
  if (!(value > 0)) fields.Fail(key, FormatFixed(value, 6), "must be greater than 0", "write a length in metres");
  return value;
}

void ReadMesh(const YamlFields& fields, const fs::path& folder, ShapeSpec* shape) {
  const std::string file = fields.RequireText("file");
  const fs::path path = (folder / file).lexically_normal();
  if (!IsMeshFile(path)) fields.Fail("file", file, "is not a mesh file", "use .stl, .obj, .dae or .ply");
  if (!fs::is_regular_file(path)) fields.Fail("file", file, "the mesh file does not exist", "check " + path.string());
  shape->kind = ShapeSpec::Kind::kMesh;
  shape->mesh_file = path.string();
  const YAML::Node scale = fields.Get("scale");
  if (!scale.IsDefined()) return;
  shape->scale = scale.IsScalar() ? Eigen::Vector3d::Constant(*fields.Number("scale")) : *fields.Vector3("scale");
  if (shape->scale.minCoeff() <= 0) fields.Fail("scale", "", "must be greater than 0", "write a positive factor");
}

/// Rotates a COLLADA mesh whose up axis is not z, so that z is up. The scale applies to the rotated axes.
void TurnMeshUp(ShapeSpec* shape) {
  const Eigen::Matrix3d turn = RotationToZUp(shape->mesh_file);
  if (turn.isIdentity()) return;
  shape->scale = (turn.transpose() * shape->scale.asDiagonal() * turn).diagonal();
  shape->pose.linear() = shape->pose.linear() * turn;
}

SceneObject ReadObject(const YAML::Node& node, const fs::path& path, const std::string& place) {
  const std::string shape_name = ReadShapeName(node, path.string(), place);
  const YamlFields fields(node, path.string(), place, KnownKeys(shape_name));
  SceneObject object;
  object.name = fields.RequireText("name");
  ShapeSpec& shape = object.shape;
  if (shape_name == "box") {
    shape.kind = ShapeSpec::Kind::kBox;
    fields.Require("size");
    shape.size = *fields.Vector3("size");
    if (!(shape.size.minCoeff() > 0)) {
      fields.Fail("size", DescribeNode(fields.Get("size")), "must be greater than 0", "write full extents [x, y, z]");
    }
  } else if (shape_name == "mesh") {
    ReadMesh(fields, path.parent_path(), &shape);
  } else {
    shape.size.x() = RequirePositive(fields, "radius");
    shape.kind = ShapeSpec::Kind::kSphere;
    if (shape_name != "sphere") {
      shape.kind = shape_name == "capsule" ? ShapeSpec::Kind::kCapsule : ShapeSpec::Kind::kCylinder;
      shape.size.z() = RequirePositive(fields, "length");
    }
  }
  const Eigen::Vector3d rpy = fields.Vector3("rpy").value_or(Eigen::Vector3d::Zero());
  shape.pose = Eigen::Translation3d(fields.Vector3("position").value_or(Eigen::Vector3d::Zero())) *
               Eigen::AngleAxisd(rpy.z(), Eigen::Vector3d::UnitZ()) *
               Eigen::AngleAxisd(rpy.y(), Eigen::Vector3d::UnitY()) *
               Eigen::AngleAxisd(rpy.x(), Eigen::Vector3d::UnitX());
  if (shape.kind == ShapeSpec::Kind::kMesh) TurnMeshUp(&shape);
  return object;
}

Scene SceneOfOneMesh(const fs::path& path, const ReadGuard& guard) {
  SceneObject object;
  object.name = path.stem().string();
  object.shape.kind = ShapeSpec::Kind::kMesh;
  object.shape.mesh_file = path.string();
  TurnMeshUp(&object.shape);
  return {.objects = {std::move(object)}, .read_guard = guard};
}

}  // namespace

bool IsMeshFile(const fs::path& path) {
  std::string suffix = path.extension().string();
  std::transform(suffix.begin(), suffix.end(), suffix.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  constexpr std::array<std::string_view, 4> kSuffixes = {".stl", ".obj", ".dae", ".ply"};
  return std::find(kSuffixes.begin(), kSuffixes.end(), suffix) != kSuffixes.end();
}

Scene ReadSceneFile(const fs::path& path, const ReadGuard& guard) {
  if (IsMeshFile(path) && fs::is_regular_file(path)) return SceneOfOneMesh(path, guard);
  const YamlFields fields(ReadYamlFile(path), path.string(), "", {"objects"});
  const YAML::Node list = fields.Require("objects");
  if (!list.IsSequence() || list.size() == 0) {
    fields.Fail("objects", DescribeNode(list), "must be a list of at least one object",
                "write '- {name: ..., shape: box, ...}' lines");
  }
  Scene scene{.objects = {}, .read_guard = guard};
  std::set<std::string> names;
  for (size_t i = 0; i < list.size(); ++i) {
    const std::string place = "objects[" + std::to_string(i) + "]";
    scene.objects.push_back(ReadObject(list[i], path, place));
    const std::string& name = scene.objects.back().name;
    if (!names.insert(name).second) fields.Fail(place + ".name", name, "the name is used twice", "rename one object");
  }
  return scene;
}

}  // namespace legopt

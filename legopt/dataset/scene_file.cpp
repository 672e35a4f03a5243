#include "legopt/dataset/scene_file.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "legopt/dataset/internal/yaml_fields.h"
#include "legopt/geometry/internal/height_map.h"
#include "legopt/geometry/internal/mesh_file.h"
#include "legopt/input/json.h"
#include "legopt/input/yaml.h"
#include "legopt/robot/internal/smallest_rotation.h"
#include "legopt/types/input_error.h"
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
  if (shape == "heightmap") keys.insert(keys.end(), {"file", "size"});
  if (shape == "plane") keys = {"name", "shape", "position", "normal", "size", "thickness"};
  return keys;
}

std::string ReadShapeName(const YAML::Node& node, const std::string& file, const std::string& place) {
  const std::vector<std::string> shapes = {"box", "sphere", "cylinder", "capsule", "mesh", "plane", "heightmap"};
  const YamlFields fields(node, file, place);  // the other keys depend on the shape and are checked later
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
  if (!IsMeshFile(path))
    fields.Fail("file", file, "is not a mesh file", "use .stl, .obj, .dae, .ply, .gltf, .glb or .off");
  if (!fs::is_regular_file(path)) fields.Fail("file", file, "the mesh file does not exist", "check " + path.string());
  shape->kind = ShapeSpec::Kind::kMesh;
  shape->mesh_file = path.string();
  const YAML::Node scale = fields.Get("scale");
  if (!scale.IsDefined()) return;
  shape->scale = scale.IsScalar() ? Eigen::Vector3d::Constant(*fields.Number("scale")) : *fields.Vector3("scale");
  if (shape->scale.minCoeff() <= 0) fields.Fail("scale", "", "must be greater than 0", "write a positive factor");
}

/// Rotates a COLLADA or glTF mesh whose up axis is not z, so that z is up. The scale applies to the rotated axes.
void TurnMeshUp(ShapeSpec* shape) {
  const Eigen::Matrix3d turn = RotationToZUp(shape->mesh_file);
  if (turn.isIdentity()) return;
  shape->scale = (turn.transpose() * shape->scale.asDiagonal() * turn).diagonal();
  shape->pose.linear() = shape->pose.linear() * turn;
}

/// Returns `count` positive numbers of a list; none if the key is missing.
std::vector<double> ReadExtents(const YamlFields& fields, const std::string& key, std::size_t count) {
  const YAML::Node node = fields.Get(key);
  std::vector<double> values;
  if (!node.IsDefined() || node.IsNull()) return values;
  bool valid = node.IsSequence() && node.size() == count;
  for (std::size_t i = 0; valid && i < count; ++i) {
    const std::optional<double> value = AsNumber(node[i]);
    valid = value && *value > 0;
    if (valid) values.push_back(*value);
  }
  if (!valid) {
    fields.Fail(key, DescribeNode(node), "must be " + std::to_string(count) + " lengths greater than 0",
                count == 2 ? "write metres, e.g. [10, 10]" : "write metres, e.g. [10, 10, 1]");
  }
  return values;
}

/// Reads a plane: the slab below it.
void ReadPlane(const YamlFields& fields, ShapeSpec* shape) {
  constexpr double kSize_m = 40.0, kThickness_m = 0.5;
  const Eigen::Vector3d normal = fields.Vector3("normal").value_or(Eigen::Vector3d::UnitZ());
  if (!(normal.norm() > 0)) fields.Fail("normal", "0 0 0", "has no direction", "write e.g. [0, 0, 1]");
  std::vector<double> size = ReadExtents(fields, "size", 2);
  if (size.empty()) size = {kSize_m, kSize_m};
  const double thickness = fields.Number("thickness") ? RequirePositive(fields, "thickness") : kThickness_m;
  shape->kind = ShapeSpec::Kind::kBox;
  shape->size = {size[0], size[1], thickness};
  shape->pose.linear() = SmallestRotation(Eigen::Vector3d::UnitZ(), normal.normalized()).toRotationMatrix();
  shape->pose.translation() =
      fields.Vector3("position").value_or(Eigen::Vector3d::Zero()) - 0.5 * thickness * normal.normalized();
}

/// Reads a height map. A picture needs three extents; the heights of a text are metres.
void ReadHeightMap(const YamlFields& fields, const fs::path& folder, ShapeSpec* shape) {
  const std::string file = fields.RequireText("file");
  const fs::path path = (folder / file).lexically_normal();
  if (!IsHeightMapFile(path)) {
    fields.Fail("file", file, "is not a height map", "use a picture (.png, .pgm) or rows of numbers (.txt, .csv)");
  }
  if (!fs::is_regular_file(path)) fields.Fail("file", file, "the height map does not exist", "check " + path.string());
  shape->kind = ShapeSpec::Kind::kMesh;
  shape->mesh_file = path.string();
  fields.Require("size");
  const bool metres = HasMetres(path) && fields.Get("size").size() == 2;
  std::vector<double> size = ReadExtents(fields, "size", metres ? 2 : 3);
  if (metres) size.push_back(1.0);
  shape->scale = {size[0], size[1], size[2]};
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
  } else if (shape_name == "plane") {
    ReadPlane(fields, &shape);
    return object;
  } else if (shape_name == "heightmap") {
    ReadHeightMap(fields, path.parent_path(), &shape);
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

namespace {

/// Returns the number, rounded to what a double stores without noise.
std::string YamlNumber(double value) {
  constexpr double kNothing = 1e-12;
  return Dump(nlohmann::json(std::abs(value) < kNothing ? 0.0 : value));
}

std::string YamlVector(const Eigen::Vector3d& v) {
  return "[" + YamlNumber(v.x()) + ", " + YamlNumber(v.y()) + ", " + YamlNumber(v.z()) + "]";
}

}  // namespace

Eigen::Vector3d RollPitchYaw(const Eigen::Matrix3d& R) {
  const double cos_pitch = std::hypot(R(0, 0), R(1, 0));
  constexpr double kGimbalLock = 1e-9;
  if (cos_pitch < kGimbalLock) return {std::atan2(-R(1, 2), R(1, 1)), std::atan2(-R(2, 0), cos_pitch), 0.0};
  return {std::atan2(R(2, 1), R(2, 2)), std::atan2(-R(2, 0), cos_pitch), std::atan2(R(1, 0), R(0, 0))};
}

std::string FormatPrimitive(const ShapeSpec& shape) {
  std::string text;
  const std::string radius = ", radius: " + YamlNumber(shape.size.x());
  const std::string length = ", length: " + YamlNumber(shape.size.z());
  switch (shape.kind) {
    case ShapeSpec::Kind::kBox:
      text = "box, size: " + YamlVector(shape.size);
      break;
    case ShapeSpec::Kind::kSphere:
      text = "sphere" + radius;
      break;
    case ShapeSpec::Kind::kCylinder:
      text = "cylinder" + radius + length;
      break;
    case ShapeSpec::Kind::kCapsule:
      text = "capsule" + radius + length;
      break;
    case ShapeSpec::Kind::kMesh:
      return "mesh";
  }
  text += ", position: " + YamlVector(shape.pose.translation());
  if (!shape.pose.linear().isIdentity()) text += ", rpy: " + YamlVector(RollPitchYaw(shape.pose.linear()));
  return text;
}

namespace {

std::string LowerCaseSuffix(const fs::path& path) {
  std::string suffix = path.extension().string();
  std::transform(suffix.begin(), suffix.end(), suffix.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return suffix;
}

/// Throws InputError for formats of scenes and meshes that are not read.
void RefuseOtherMeshFormat(const fs::path& path) {
  constexpr std::array<std::string_view, 11> kOthers = {".fbx",  ".3ds",  ".blend", ".usd", ".usda", ".usdc",
                                                        ".usdz", ".step", ".stp",   ".wrl", ".x3d"};
  const std::string suffix = LowerCaseSuffix(path);
  if (std::ranges::find(kOthers, suffix) == kOthers.end()) return;
  throw InputError({path.string(), "", suffix, "this format of meshes and scenes is not read",
                    "export it as .stl, .obj, .dae, .ply, .gltf, .glb or .off"});
}

}  // namespace

bool IsMeshFile(const fs::path& path) {
  const std::string suffix = LowerCaseSuffix(path);
  constexpr std::array<std::string_view, 7> kSuffixes = {".stl", ".obj", ".dae", ".ply", ".gltf", ".glb", ".off"};
  return std::find(kSuffixes.begin(), kSuffixes.end(), suffix) != kSuffixes.end();
}

Scene ReadSceneFile(const fs::path& path, const ReadGuard& guard) {
  if (IsMeshFile(path) && fs::is_regular_file(path)) return SceneOfOneMesh(path, guard);
  RefuseOtherMeshFormat(path);
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

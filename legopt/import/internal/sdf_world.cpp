#include "legopt/import/internal/sdf_world.h"

#include <tinyxml2.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <optional>
#include <sdf/sdf.hh>
#include <string>
#include <string_view>

#include "legopt/geometry/internal/height_map.h"
#include "legopt/input/json.h"
#include "legopt/input/text.h"
#include "legopt/types/input_error.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double kMinPlane_m = 40.0, kPlaneThickness_m = 0.5;
constexpr std::size_t kMaxSdfBytes = std::size_t{64} << 20;

[[noreturn]] void RefuseSdf(const fs::path& path, const std::string& field, const std::string& value,
                            const std::string& message, const std::string& fix) {
  throw InputError({path.string(), field, value, message, fix});
}

/// Returns the file or folder of a model://, file:// or relative URI; empty if there is none.
fs::path FindByUri(const fs::path& folder, const std::string& uri) {
  std::string place = uri;
  for (const std::string scheme : {"model://", "file://", "package://"}) {
    if (place.starts_with(scheme)) place = place.substr(scheme.size());
  }
  constexpr int kLevels = 4;
  fs::path base = folder;
  for (int level = 0; level < kLevels; ++level) {
    for (const fs::path& candidate : {base / place, base / "models" / place}) {
      if (fs::exists(candidate)) return candidate;
    }
    base = base.parent_path();
  }
  return {};
}

/// Replaces includes of Gazebo's own models that are not there: the ground plane becomes a plane, the sun nothing.
void ResolveBuiltIn(const fs::path& folder, tinyxml2::XMLElement* parent) {
  for (tinyxml2::XMLElement* child = parent->FirstChildElement(); child != nullptr;) {
    tinyxml2::XMLElement* next = child->NextSiblingElement();
    const tinyxml2::XMLElement* uri =
        std::string_view(child->Name()) == "include" ? child->FirstChildElement("uri") : nullptr;
    const std::string text = uri != nullptr && uri->GetText() != nullptr ? uri->GetText() : "";
    const bool ground = text.ends_with("/ground_plane") || text.ends_with("/Ground Plane");
    const bool sun = text.ends_with("/sun") || text.ends_with("/Sun");
    if ((ground || sun) && FindByUri(folder, text).empty()) {
      if (ground) {
        tinyxml2::XMLDocument model;
        model.Parse(
            "<model name='ground_plane'><static>true</static><link name='link'><collision name='collision'><geometry>"
            "<plane><normal>0 0 1</normal><size>100 100</size></plane></geometry></collision></link></model>");
        parent->InsertAfterChild(child, model.RootElement()->DeepClone(parent->GetDocument()));
      }
      parent->DeleteChild(child);
    } else {
      ResolveBuiltIn(folder, child);
    }
    child = next;
  }
}

/// Turns a world into JSON in the guarded process; the caller builds the scene from it.
class SdfReader {
 public:
  explicit SdfReader(const fs::path& path) : path_(path), folder_(path.parent_path()) {}

  /// Returns {"objects": [...]} or {"field", "value", "message", "fix"} of an error.
  json Read() {
    tinyxml2::XMLDocument document;
    const std::string text = ReadFileText(path_, kMaxSdfBytes);
    if (document.Parse(text.c_str(), text.size()) != tinyxml2::XML_SUCCESS || document.RootElement() == nullptr) {
      return Fault("line " + std::to_string(document.ErrorLineNum()), "",
                   std::string("not valid XML: ") + document.ErrorName(), "export the world again");
    }
    ResolveBuiltIn(folder_, document.RootElement());
    tinyxml2::XMLPrinter printer;
    document.Print(&printer);
    sdf::Console::Instance()->SetQuiet(true);
    sdf::ParserConfig config;
    config.SetFindCallback([this](const std::string& uri) { return FindByUri(folder_, uri).string(); });
    sdf::Root root;
    const sdf::Errors errors = root.LoadSdfString(printer.CStr(), config);
    if (!errors.empty()) {
      return Fault("", "", "is no SDF that can be read: " + errors.front().Message(),
                   "correct it; models that it includes belong beside it or into a folder 'models'");
    }
    for (std::uint64_t w = 0; w < root.WorldCount(); ++w) {
      const sdf::World& world = *root.WorldByIndex(w);
      for (std::uint64_t m = 0; m < world.ModelCount(); ++m) {
        AddModel(*world.ModelByIndex(m), Eigen::Isometry3d::Identity(), "");
      }
    }
    if (root.Model() != nullptr) AddModel(*root.Model(), Eigen::Isometry3d::Identity(), "");
    if (!fault_.is_null()) return fault_;
    return {{"objects", objects_}};
  }

 private:
  static json Fault(const std::string& field, const std::string& value, const std::string& message,
                    const std::string& fix) {
    return {{"field", field}, {"value", value}, {"message", message}, {"fix", fix}};
  }

  static Eigen::Isometry3d PoseOf(const ignition::math::Pose3d& pose) {
    const auto& q = pose.Rot();
    return Eigen::Translation3d(pose.Pos().X(), pose.Pos().Y(), pose.Pos().Z()) *
           Eigen::Quaterniond(q.W(), q.X(), q.Y(), q.Z()).normalized();
  }

  template <class Element>
  Eigen::Isometry3d Resolve(const Element& element, const std::string& name) {
    ignition::math::Pose3d pose;
    const sdf::Errors errors = element.SemanticPose().Resolve(pose);
    if (!errors.empty()) fault_ = Fault(name, "", errors.front().Message(), "correct the <pose>");
    return PoseOf(pose);
  }

  void AddModel(const sdf::Model& model, const Eigen::Isometry3d& parent, const std::string& prefix) {
    const std::string name = prefix + model.Name();
    const Eigen::Isometry3d X_WM = parent * Resolve(model, name);
    for (std::uint64_t l = 0; l < model.LinkCount(); ++l) {
      const sdf::Link& link = *model.LinkByIndex(l);
      const std::string link_name = name + "/" + link.Name();
      const Eigen::Isometry3d X_WL = X_WM * Resolve(link, link_name);
      for (std::uint64_t c = 0; c < link.CollisionCount(); ++c) {
        const sdf::Collision& collision = *link.CollisionByIndex(c);
        const std::string own = link_name + "/" + collision.Name();
        AddShape(*collision.Geom(), X_WL * Resolve(collision, own), own);
      }
    }
    for (std::uint64_t m = 0; m < model.ModelCount(); ++m) AddModel(*model.ModelByIndex(m), X_WM, name + "/");
  }

  static json ThreeOf(const ignition::math::Vector3d& v) { return {v.X(), v.Y(), v.Z()}; }

  void AddShape(const sdf::Geometry& geometry, Eigen::Isometry3d pose, const std::string& name) {
    json object = {{"name", name}};
    switch (geometry.Type()) {
      case sdf::GeometryType::EMPTY:
        return;
      case sdf::GeometryType::BOX:
        object["kind"] = "box";
        object["size"] = ThreeOf(geometry.BoxShape()->Size());
        break;
      case sdf::GeometryType::SPHERE:
        object["kind"] = "sphere";
        object["size"] = {geometry.SphereShape()->Radius(), 0.0, 0.0};
        break;
      case sdf::GeometryType::CYLINDER:
        object["kind"] = "cylinder";
        object["size"] = {geometry.CylinderShape()->Radius(), 0.0, geometry.CylinderShape()->Length()};
        break;
      case sdf::GeometryType::CAPSULE:
        object["kind"] = "capsule";
        object["size"] = {geometry.CapsuleShape()->Radius(), 0.0, geometry.CapsuleShape()->Length()};
        break;
      case sdf::GeometryType::PLANE: {
        const ignition::math::Vector3d n = geometry.PlaneShape()->Normal();
        const Eigen::Vector3d normal(n.X(), n.Y(), n.Z());
        pose = pose * Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), normal) *
               Eigen::Translation3d(0.0, 0.0, -0.5 * kPlaneThickness_m);
        object["kind"] = "box";
        object["size"] = {std::max(kMinPlane_m, geometry.PlaneShape()->Size().X()),
                          std::max(kMinPlane_m, geometry.PlaneShape()->Size().Y()), kPlaneThickness_m};
        break;
      }
      case sdf::GeometryType::MESH:
        object["kind"] = "mesh";
        object["uri"] = geometry.MeshShape()->Uri();
        object["folder"] = fs::path(geometry.MeshShape()->FilePath()).parent_path().string();
        object["size"] = ThreeOf(geometry.MeshShape()->Scale());
        break;
      case sdf::GeometryType::HEIGHTMAP: {
        const ignition::math::Vector3d at = geometry.HeightmapShape()->Position();
        pose = pose * Eigen::Translation3d(at.X(), at.Y(), at.Z());
        object["kind"] = "heightmap";
        object["uri"] = geometry.HeightmapShape()->Uri();
        object["folder"] = fs::path(geometry.HeightmapShape()->FilePath()).parent_path().string();
        object["size"] = ThreeOf(geometry.HeightmapShape()->Size());
        break;
      }
      default:
        fault_ = Fault(name, "", "its collision shape is of a kind that cannot be read",
                       "use a box, sphere, cylinder, capsule, plane, mesh or heightmap");
        return;
    }
    const Eigen::Matrix4d matrix = pose.matrix();
    object["pose"] = std::vector<double>(matrix.data(), matrix.data() + matrix.size());
    objects_.push_back(std::move(object));
  }

  const fs::path& path_;
  const fs::path folder_;
  json objects_ = json::array();
  json fault_;
};

/// Hides the home folder while libsdformat runs: it would write a log there.
class NoHome {
 public:
  NoHome() {
    if (const char* home = std::getenv("HOME")) home_ = home;
    unsetenv("HOME");
  }
  ~NoHome() {
    if (home_) setenv("HOME", home_->c_str(), 1);
  }
  NoHome(const NoHome&) = delete;
  NoHome& operator=(const NoHome&) = delete;

 private:
  std::optional<std::string> home_;
};

SceneObject ObjectFrom(const json& source, const fs::path& path) {
  using Kind = ShapeSpec::Kind;
  SceneObject object;
  object.name = source.at("name").get<std::string>();
  const auto size = source.at("size").get<std::array<double, 3>>();
  const auto pose = source.at("pose").get<std::array<double, 16>>();
  ShapeSpec& shape = object.shape;
  shape.pose.matrix() = Eigen::Map<const Eigen::Matrix4d>(pose.data());
  const std::string kind = source.at("kind").get<std::string>();
  const Eigen::Vector3d extents(size[0], size[1], size[2]);
  if (kind == "box" || kind == "sphere" || kind == "cylinder" || kind == "capsule") {
    shape.kind = kind == "box"        ? Kind::kBox
                 : kind == "sphere"   ? Kind::kSphere
                 : kind == "cylinder" ? Kind::kCylinder
                                      : Kind::kCapsule;
    shape.size = extents;
    return object;
  }
  const std::string uri = source.at("uri").get<std::string>();
  const fs::path own = source.at("folder").get<std::string>();
  fs::path file = own.is_absolute() ? FindByUri(own, uri) : fs::path();
  if (file.empty()) file = FindByUri(path.parent_path(), uri);
  if (file.empty()) {
    RefuseSdf(path, object.name, uri, "there is no such file", "put it beside the world or into a folder 'models'");
  }
  if (kind == "heightmap" && !IsHeightMapFile(file)) {
    RefuseSdf(path, object.name, uri, "is not a height map that can be read", "convert it to PNG or PGM");
  }
  shape.kind = Kind::kMesh;
  shape.mesh_file = file.string();
  shape.scale = extents;
  return object;
}

}  // namespace

bool IsSdfFile(const fs::path& path) {
  std::string suffix = path.extension().string();
  std::transform(suffix.begin(), suffix.end(), suffix.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return suffix == ".sdf" || suffix == ".world";
}

Scene ReadSdfWorld(const fs::path& path, const ReadGuard& guard) {
  const auto read = [&path] {
    const NoHome hidden;
    return Dump(SdfReader(path).Read());
  };
  std::string answer;
  try {
    answer = guard ? guard(read, {.cpu_s = 30}) : read();
  } catch (const GuardedReadError& failure) {
    RefuseSdf(path, "", "", std::string("cannot be read: the reader failed: ") + failure.what(),
              "export the world again");
  }
  const json world = ParseJson(answer, path.string());
  if (!world.contains("objects")) {
    RefuseSdf(path, world.at("field").get<std::string>(), world.at("value").get<std::string>(),
              world.at("message").get<std::string>(), world.at("fix").get<std::string>());
  }
  Scene scene{.objects = {}, .read_guard = guard};
  for (const json& object : world.at("objects")) scene.objects.push_back(ObjectFrom(object, path));
  if (scene.objects.empty()) {
    RefuseSdf(path, "", "", "has no collision shape", "add <collision> elements to its models");
  }
  return scene;
}

}  // namespace legopt

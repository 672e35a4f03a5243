#include "legopt/import/internal/sdf_module.h"

#include <tinyxml2.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <filesystem>
#include <sdf/sdf.hh>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "legopt/import/internal/model_uri.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double kMinPlane_m = 40.0, kPlaneThickness_m = 0.5;

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

/// Turns a world into JSON.
class SdfReader {
 public:
  explicit SdfReader(fs::path folder) : folder_(std::move(folder)) {}

  json Read(const std::string& text) {
    tinyxml2::XMLDocument document;
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

  const fs::path folder_;
  json objects_ = json::array();
  json fault_;
};

}  // namespace
}  // namespace legopt

extern "C" void legopt_read_sdf(const std::string& text, const std::string& folder, nlohmann::json* world) {
  *world = legopt::SdfReader(folder).Read(text);
}

static_assert(std::is_same_v<legopt::ReadSdfFunction, decltype(&legopt_read_sdf)>);

#include "legopt/import/robot_files.h"

#include <tinyxml2.h>

#include <cctype>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <system_error>

#include "legopt/dataset/text_file.h"
#include "legopt/files/output_file.h"
#include "legopt/geometry/mesh_writer.h"
#include "legopt/input/json.h"
#include "legopt/types/input_error.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;
using tinyxml2::XMLElement;

/// Generates unique file names from arbitrary text.
class FileNames {
 public:
  std::string Take(const std::string& stem, const std::string& suffix) {
    std::string plain;
    for (const unsigned char c : stem)
      plain += std::isalnum(c) != 0 || c == '_' || c == '-' ? static_cast<char>(c) : '_';
    std::string name = plain + suffix;
    for (int k = 2; !taken_.insert(name).second; ++k) name = plain + "-" + std::to_string(k) + suffix;
    return name;
  }

 private:
  std::set<std::string> taken_;
};

void MakeFolder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) {
    throw InputError(
        {folder.string(), "", "", "cannot be made: " + error.message(), "check permissions and free space"});
  }
}

/// Formats a number as the shortest text that parses to the same double; rounding errors near zero become zero.
std::string Number(double value) {
  constexpr double kDust = 1e-12;
  return Dump(nlohmann::json(std::abs(value) < kDust ? 0.0 : value));
}

std::string Numbers(const Eigen::Vector3d& v) { return Number(v.x()) + " " + Number(v.y()) + " " + Number(v.z()); }

/// Returns the fixed-axis roll, pitch and yaw of R = Rz Ry Rx.
Eigen::Vector3d RollPitchYaw(const Eigen::Matrix3d& R) {
  const double cos_pitch = std::hypot(R(0, 0), R(1, 0));
  constexpr double kGimbalLock = 1e-9;
  if (cos_pitch < kGimbalLock) return {std::atan2(-R(1, 2), R(1, 1)), std::atan2(-R(2, 0), cos_pitch), 0.0};
  return {std::atan2(R(2, 1), R(2, 2)), std::atan2(-R(2, 0), cos_pitch), std::atan2(R(1, 0), R(0, 0))};
}

void SetOrigin(const Eigen::Isometry3d& pose, XMLElement* parent) {
  XMLElement* origin = parent->InsertNewChildElement("origin");
  origin->SetAttribute("xyz", Numbers(pose.translation()).c_str());
  origin->SetAttribute("rpy", Numbers(RollPitchYaw(pose.linear())).c_str());
}

void AddInertial(const ColladaLink& link, XMLElement* element) {
  if (link.mass == 0.0) return;
  XMLElement* inertial = element->InsertNewChildElement("inertial");
  inertial->InsertNewChildElement("origin")->SetAttribute("xyz", Numbers(link.com).c_str());
  inertial->InsertNewChildElement("mass")->SetAttribute("value", Number(link.mass).c_str());
  XMLElement* inertia = inertial->InsertNewChildElement("inertia");
  const Eigen::Matrix3d& i = link.inertia;
  for (const auto& [key, value] : {std::pair("ixx", i(0, 0)), std::pair("ixy", i(0, 1)), std::pair("ixz", i(0, 2)),
                                   std::pair("iyy", i(1, 1)), std::pair("iyz", i(1, 2)), std::pair("izz", i(2, 2))}) {
    inertia->SetAttribute(key, Number(value).c_str());
  }
}

void AddLink(const ColladaLink& link, const fs::path& folder, FileNames* names, XMLElement* robot) {
  XMLElement* element = robot->InsertNewChildElement("link");
  element->SetAttribute("name", link.name.c_str());
  AddInertial(link, element);
  for (const ColladaGeometry& geometry : link.geometries) {
    const std::string file = std::string(kRobotMeshFolder) + "/" + names->Take(link.name, ".ply");
    WritePly(folder / file, geometry.mesh);
    XMLElement* collision = element->InsertNewChildElement("collision");
    SetOrigin(geometry.pose, collision);
    collision->InsertNewChildElement("geometry")->InsertNewChildElement("mesh")->SetAttribute("filename", file.c_str());
  }
}

const char* TypeName(JointType type) {
  switch (type) {
    case JointType::kRevolute:
      return "revolute";
    case JointType::kContinuous:
      return "continuous";
    case JointType::kPrismatic:
      return "prismatic";
    case JointType::kFixed:
      return "fixed";
  }
  return "";
}

void AddJoint(const ColladaRobot& robot, const ColladaJoint& source, XMLElement* parent) {
  const Joint& joint = source.joint;
  XMLElement* element = parent->InsertNewChildElement("joint");
  element->SetAttribute("name", joint.name.c_str());
  element->SetAttribute("type", TypeName(joint.type));
  SetOrigin(joint.origin, element);
  const auto link = [&](int index) { return robot.links[static_cast<size_t>(index)].name; };
  element->InsertNewChildElement("parent")->SetAttribute("link", link(joint.parent_link).c_str());
  element->InsertNewChildElement("child")->SetAttribute("link", link(joint.child_link).c_str());
  if (joint.type == JointType::kFixed) return;
  element->InsertNewChildElement("axis")->SetAttribute("xyz", Numbers(joint.axis).c_str());
  XMLElement* limit = element->InsertNewChildElement("limit");
  if (joint.type != JointType::kContinuous) {
    limit->SetAttribute("lower", Number(joint.lower).c_str());
    limit->SetAttribute("upper", Number(joint.upper).c_str());
  }
  limit->SetAttribute("effort", Number(source.effort).c_str());
  limit->SetAttribute("velocity", Number(source.velocity).c_str());
}

std::string Print(const tinyxml2::XMLDocument& document) {
  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  return printer.CStr();
}

/// Copies meshes under unique names, each file once.
class MeshCopier {
 public:
  explicit MeshCopier(const fs::path& folder) : folder_(folder) {}

  /// Copies a mesh and returns the copy's path relative to the folder.
  std::string Copy(const fs::path& mesh) {
    const auto [place, fresh] = copies_.try_emplace(mesh.string());
    if (!fresh) return place->second;
    place->second = std::string(kRobotMeshFolder) + "/" + names_.Take(mesh.stem().string(), mesh.extension().string());
    CopyOutputFile(mesh, folder_ / place->second);
    return place->second;
  }

 private:
  const fs::path& folder_;
  FileNames names_;
  std::map<std::string, std::string> copies_;
};

/// Sets the new file names of a <link>'s collision meshes. RobotModel lists shapes in the order of the elements.
void RenameMeshes(const Link& link, XMLElement* element, MeshCopier* copier) {
  size_t shape = 0;
  for (XMLElement* e = element->FirstChildElement("collision"); e != nullptr; e = e->NextSiblingElement("collision")) {
    XMLElement* geometry = e->FirstChildElement("geometry");
    if (geometry == nullptr || shape >= link.collision.size()) continue;
    const ShapeSpec& spec = link.collision[shape++];
    XMLElement* mesh = geometry->FirstChildElement("mesh");
    if (spec.kind != ShapeSpec::Kind::kMesh || mesh == nullptr) continue;
    mesh->SetAttribute("filename", copier->Copy(spec.mesh_file).c_str());
  }
}

/// Removes the <visual> elements; returns true if there were any.
bool RemoveVisuals(XMLElement* link) {
  bool removed = false;
  for (XMLElement* e = link->FirstChildElement("visual"); e != nullptr; e = link->FirstChildElement("visual")) {
    link->DeleteChild(e);
    removed = true;
  }
  return removed;
}

}  // namespace

void WriteColladaRobot(const ColladaRobot& robot, const fs::path& folder) {
  MakeFolder(folder / kRobotMeshFolder);
  tinyxml2::XMLDocument document;
  document.InsertEndChild(document.NewDeclaration());
  XMLElement* element = document.NewElement("robot");
  document.InsertEndChild(element);
  element->SetAttribute("name", robot.name.c_str());
  FileNames names;
  for (const ColladaLink& link : robot.links) AddLink(link, folder, &names, element);
  for (const ColladaJoint& joint : robot.joints) AddJoint(robot, joint, element);
  WriteTextFile(folder / kRobotFileName, Print(document));
}

std::vector<DatasetDiagnostic> CopyUrdfRobot(const fs::path& urdf, const fs::path& folder, const ReadGuard& guard) {
  const RobotModel robot = RobotModel::FromUrdfFile(urdf.string(), guard);
  tinyxml2::XMLDocument document;
  document.LoadFile(urdf.string().c_str());  // cannot fail: the file was read before
  MakeFolder(folder / kRobotMeshFolder);
  MeshCopier copier(folder);
  std::string visual_only;
  XMLElement* root = document.FirstChildElement("robot");
  for (XMLElement* e = root->FirstChildElement("link"); e != nullptr; e = e->NextSiblingElement("link")) {
    const Link& link = robot.links()[static_cast<size_t>(robot.FindLink(e->Attribute("name")))];
    RenameMeshes(link, e, &copier);
    if (!RemoveVisuals(e) || !link.collision.empty()) continue;
    visual_only += (visual_only.empty() ? "" : ", ") + link.name;
  }
  std::error_code ignored;
  fs::remove(folder / kRobotMeshFolder, ignored);  // succeeds only if the folder is empty
  WriteTextFile(folder / kRobotFileName, Print(document));
  if (visual_only.empty()) return {};
  return {{.severity = DatasetDiagnostic::Severity::kWarning,
           .check = "robot",
           .file = urdf.string(),
           .field = "links",
           .value = visual_only,
           .message = "have a <visual>, but no <collision>: they never touch anything",
           .fix = "copy their <visual> to a <collision> if they should"}};
}

}  // namespace legopt

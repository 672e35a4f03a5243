#include "legopt/import/internal/copied_robot.h"

#include <tinyxml2.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <exception>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <system_error>
#include <utility>
#include <vector>

#include "legopt/dataset/internal/text_file.h"
#include "legopt/dataset/scene_file.h"
#include "legopt/files/written_file.h"
#include "legopt/geometry/internal/mesh_file.h"
#include "legopt/import/internal/link_mesh_repair.h"
#include "legopt/input/json.h"
#include "legopt/math/parallel.h"
#include "legopt/robot/internal/urdf_check.h"
#include "legopt/robot/internal/urdf_reader.h"
#include "legopt/types/input_error.h"

namespace legopt {

void MakeFolder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    throw InputError(
        {folder.string(), "", "", "cannot be made: " + error.message(), "check permissions and free space"});
  }
}

namespace {

namespace fs = std::filesystem;
using Severity = DatasetDiagnostic::Severity;
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

/// Formats a number as the shortest text that parses to the same double; rounding errors near zero become zero.
std::string Number(double value) {
  constexpr double kDust = 1e-12;
  return Dump(nlohmann::json(std::abs(value) < kDust ? 0.0 : value));
}

std::string Numbers(const Eigen::Vector3d& v) { return Number(v.x()) + " " + Number(v.y()) + " " + Number(v.z()); }

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

void AddJoint(const ColladaRobot& robot, const ColladaJoint& source, XMLElement* parent) {
  const Joint& joint = source.joint;
  XMLElement* element = parent->InsertNewChildElement("joint");
  element->SetAttribute("name", joint.name.c_str());
  element->SetAttribute("type", std::string(ToString(joint.type)).c_str());
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

/// Repairs mesh files, some at once. Holds few meshes at a time.
class MeshRepairer {
 public:
  /// `files`: without duplicates, in the order in which they will be taken. `guard` must outlive this object.
  MeshRepairer(std::vector<std::string> files, const ReadGuard& guard) : files_(std::move(files)), guard_(guard) {}

  /// Returns a file's repaired mesh. Throws the InputError of LoadMesh.
  RepairedLinkMesh Take(const std::string& file) {
    if (!ready_.contains(file)) RepairFrom(std::ranges::find(files_, file));
    Outcome outcome = std::move(ready_.extract(file).mapped());
    if (outcome.failure) std::rethrow_exception(outcome.failure);
    return std::move(outcome.repaired);
  }

 private:
  struct Outcome {
    TriangleMesh mesh;
    RepairedLinkMesh repaired;
    std::exception_ptr failure;
  };

  // This thread alone reads the files, because their reader is forked, and other threads may hold locks then.
  void RepairFrom(std::vector<std::string>::const_iterator next) {
    const int threads = NumProcessors();
    std::vector<Outcome*> batch;
    for (; next != files_.end() && std::ssize(batch) < threads; ++next) {
      Outcome& outcome = ready_[*next];
      try {
        outcome.mesh = LoadMesh(*next, Eigen::Vector3d::Ones(), guard_);
        batch.push_back(&outcome);
      } catch (const InputError&) {
        outcome.failure = std::current_exception();
        break;
      }
    }
    ForEachIndex(threads, batch.size(), [&](int, std::size_t i) {
      batch[i]->repaired = RepairLinkMesh(batch[i]->mesh);
      batch[i]->mesh = {};
    });
  }

  std::vector<std::string> files_;
  const ReadGuard& guard_;
  std::map<std::string, Outcome> ready_;
};

/// Copies meshes under unique names, each file once.
class MeshCopier {
 public:
  /// `files`: of all meshes, without duplicates, in the order in which they will be copied.
  MeshCopier(const fs::path& folder, const RobotCopyOptions& options, std::vector<std::string> files)
      : folder_(folder), options_(options), repairer_(std::move(files), options.read_guard) {}

  /// Copies or repairs a mesh and returns the copy's path relative to the folder; empty if it has no triangles or there
  /// is no such file (`mesh` is empty). `link` names the user.
  std::string Copy(const fs::path& mesh, const std::string& link) {
    if (mesh.empty()) {
      absent_ += (absent_.empty() ? "" : ", ") + link;
      return "";
    }
    const auto [place, fresh] = copies_.try_emplace(mesh.string());
    if (fresh) place->second = Write(mesh, link);
    if (place->second.empty()) empty_ += (empty_.empty() ? "" : ", ") + link;
    return place->second;
  }

  std::vector<DatasetDiagnostic> Findings() const {
    std::vector<DatasetDiagnostic> findings;
    const auto add = [&](Severity severity, const std::string& links, const std::string& value, const char* message,
                         const char* fix) {
      if (!links.empty()) findings.push_back({severity, "link meshes", "", links, value, message, fix});
    };
    add(Severity::kRepaired, turned_, std::to_string(num_turned_) + (num_turned_ == 1 ? " body" : " bodies"),
        "wound inside out or not consistently, turned round", "");
    add(Severity::kRepaired, welded_, std::to_string(num_welded_) + " vertices",
        "at most 10 um from others, welded to them", "");
    add(Severity::kWarning, absent_, "", "mesh files that do not exist, left out: the links collide with nothing there",
        "give their folder with --mesh-path");
    add(Severity::kWarning, empty_, "", "meshes without triangles, left out", "export them again if they matter");
    add(Severity::kWarning, flat_, "", "meshes without volume: contacts are measured, but nothing is inside them",
        "give them a thickness, e.g. 1 mm");
    return findings;
  }

 private:
  std::string Write(const fs::path& mesh, const std::string& link) {
    const auto name = [&](const std::string& suffix) {
      return std::string(kRobotMeshFolder) + "/" + names_.Take(mesh.stem().string(), suffix);
    };
    if (options_.repair) {
      try {
        const RepairedLinkMesh repaired = repairer_.Take(mesh.string());
        Count(repaired, link);
        if (repaired.changed()) {
          const std::string file = name(".ply");
          WritePly(folder_ / file, repaired.mesh);
          return file;
        }
      } catch (const InputError& error) {
        if (IsWithoutTriangles(error)) return "";
        throw;
      }
    }
    const std::string file = name(mesh.extension().string());
    CopyOutputFile(mesh, folder_ / file);
    return file;
  }

  void Count(const RepairedLinkMesh& repaired, const std::string& link) {
    const auto add = [&](std::string* list) { *list += (list->empty() ? "" : ", ") + link; };
    if (repaired.turned > 0) add(&turned_);
    if (repaired.welded > 0) add(&welded_);
    if (repaired.flat) add(&flat_);
    num_turned_ += repaired.turned;
    num_welded_ += repaired.welded;
  }

  /// LoadMesh reports missing triangles in its own words or in those of assimp's STL reader.
  static bool IsWithoutTriangles(const InputError& error) {
    const std::string& message = error.fault().message;
    return message.find("no triangles") != std::string::npos || message.find("no facets") != std::string::npos;
  }

  const fs::path& folder_;
  const RobotCopyOptions& options_;
  MeshRepairer repairer_;
  FileNames names_;
  std::map<std::string, std::string> copies_;
  std::string turned_, welded_, flat_, empty_, absent_;  ///< names of links
  int num_turned_ = 0, num_welded_ = 0;
};

const Link& LinkOf(const RobotModel& robot, const XMLElement& element) {
  return robot.links()[static_cast<size_t>(robot.FindLink(element.Attribute("name")))];
}

/// Returns the mesh files of collision geometries, each once, in the order of the <link> elements.
std::vector<std::string> MeshFilesOf(const RobotModel& robot, const XMLElement* root) {
  std::vector<std::string> files;
  std::set<std::string> known;
  for (const XMLElement* e = root->FirstChildElement("link"); e != nullptr; e = e->NextSiblingElement("link")) {
    for (const ShapeSpec& shape : LinkOf(robot, *e).collision) {
      if (shape.kind == ShapeSpec::Kind::kMesh && !shape.mesh_file.empty() && known.insert(shape.mesh_file).second) {
        files.push_back(shape.mesh_file);
      }
    }
  }
  return files;
}

/// Sets the new file names and scales of a <link>'s collision meshes and removes meshes without triangles. RobotModel
/// lists shapes in the order of the elements.
void RenameMeshes(const Link& link, XMLElement* element, double mesh_scale, MeshCopier* copier) {
  size_t shape = 0;
  for (XMLElement *e = element->FirstChildElement("collision"), *next = nullptr; e != nullptr; e = next) {
    next = e->NextSiblingElement("collision");
    XMLElement* geometry = e->FirstChildElement("geometry");
    if (geometry == nullptr || shape >= link.collision.size()) continue;
    const ShapeSpec& spec = link.collision[shape++];
    XMLElement* mesh = geometry->FirstChildElement("mesh");
    if (spec.kind != ShapeSpec::Kind::kMesh || mesh == nullptr) continue;
    const std::string copy = copier->Copy(spec.mesh_file, link.name);
    if (copy.empty()) {
      element->DeleteChild(e);
      continue;
    }
    mesh->SetAttribute("filename", copy.c_str());
    if (mesh_scale != 1.0) mesh->SetAttribute("scale", Numbers(mesh_scale * spec.scale).c_str());
  }
}

/// Renames the <visual> elements of links without <collision>. Text that is no XML stays for CheckUrdf to report.
std::string WithVisualsAsCollisions(const std::string& text, std::string* links) {
  tinyxml2::XMLDocument document;
  if (document.Parse(text.c_str(), text.size()) != tinyxml2::XML_SUCCESS) return text;
  XMLElement* root = document.FirstChildElement("robot");
  if (root == nullptr) return text;
  for (XMLElement* link = root->FirstChildElement("link"); link != nullptr; link = link->NextSiblingElement("link")) {
    if (link->FirstChildElement("collision") != nullptr || link->FirstChildElement("visual") == nullptr) continue;
    while (XMLElement* visual = link->FirstChildElement("visual")) {
      visual->SetName("collision");
      while (XMLElement* material = visual->FirstChildElement("material")) visual->DeleteChild(material);
    }
    const char* name = link->Attribute("name");
    *links += (links->empty() ? "" : ", ") + std::string(name == nullptr ? "?" : name);
  }
  return links->empty() ? text : Print(document);
}

Severity SeverityOf(UrdfSeverity severity) {
  switch (severity) {
    case UrdfSeverity::kInfo:
      return Severity::kInfo;
    case UrdfSeverity::kRepaired:
      return Severity::kRepaired;
    case UrdfSeverity::kWarning:
      return Severity::kWarning;
  }
  return Severity::kWarning;
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

std::vector<DatasetDiagnostic> CopyUrdfRobot(const fs::path& urdf, const fs::path& folder,
                                             const RobotCopyOptions& options) {
  std::string text = ReadUrdfFile(urdf.string()), from_visuals;
  if (options.visuals) text = WithVisualsAsCollisions(text, &from_visuals);
  const MeshPlaces meshes{fs::absolute(urdf).parent_path().lexically_normal(), options.meshes};
  CheckedUrdf checked = CheckUrdf(text, urdf.string(), &meshes);
  const RobotModel robot =
      BuildUrdfTree(checked, ReadByUrdfdom(checked), urdf.parent_path().string(), &checked.notes, options.meshes);
  tinyxml2::XMLDocument document;
  document.Parse(checked.text.c_str());  // cannot fail: CheckUrdf wrote this text
  MakeFolder(folder / kRobotMeshFolder);
  XMLElement* root = document.FirstChildElement("robot");
  MeshCopier copier(folder, options, MeshFilesOf(robot, root));
  for (XMLElement* e = root->FirstChildElement("link"); e != nullptr; e = e->NextSiblingElement("link")) {
    RenameMeshes(LinkOf(robot, *e), e, options.mesh_scale, &copier);
  }
  std::error_code ignored;
  fs::remove(folder / kRobotMeshFolder, ignored);  // succeeds only if the folder is empty
  WriteTextFile(folder / kRobotFileName, Print(document));
  std::vector<DatasetDiagnostic> findings;
  for (const UrdfDiagnostic& note : checked.notes) {
    findings.push_back(
        {SeverityOf(note.severity), "robot", urdf.string(), note.field, note.value, note.message, note.fix});
  }
  for (DatasetDiagnostic& finding : copier.Findings()) findings.push_back(std::move(finding));
  if (!from_visuals.empty()) {
    findings.push_back({Severity::kInfo, "robot", "", from_visuals, "",
                        "have no <collision>; their <visual> geometry is used for it", ""});
  }
  return findings;
}

}  // namespace legopt

#include "legopt/robot/internal/urdf_check.h"

#include <tinyxml2.h>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include "legopt/input/text.h"
#include "legopt/robot/internal/urdf_reader.h"
#include "legopt/robot/internal/urdf_rules.h"
#include "legopt/robot/internal/urdf_walk.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"

namespace legopt {
namespace {

using tinyxml2::XMLAttribute;
using tinyxml2::XMLElement;

constexpr std::size_t kMostLinks = 2000;
constexpr std::size_t kMostBytes = std::size_t{16} << 20;

bool HasText(const XMLElement* element, const char* attribute) {
  return element != nullptr && element->Attribute(attribute) != nullptr;
}

/// Returns true if the copy has everything by which its parts refer to each other, so that later checks can go on
/// although some parts were refused.
bool IsConnectable(const XMLElement& robot) {
  if (!HasText(&robot, "name")) return false;
  for (const auto* e = robot.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
    if (!HasText(e, "name")) return false;
    if (e->Name() == std::string_view("joint")) {
      if (!HasText(e, "type")) return false;
      for (const char* end : {"parent", "child"}) {
        if (!HasText(e->FirstChildElement(end), "link")) return false;
      }
      const XMLElement* mimic = e->FirstChildElement("mimic");
      if (mimic != nullptr && !HasText(mimic, "joint")) return false;
    }
    for (const auto* c = e->FirstChildElement("collision"); c != nullptr; c = c->NextSiblingElement("collision")) {
      if (c->FirstChildElement("geometry") == nullptr) return false;
    }
  }
  return true;
}

/// Returns the links of the tree around `start`, which `joint` connects with the rest of the robot.
std::set<std::string> LinksBefore(const XMLElement& robot, const XMLElement& joint, const std::string& start) {
  std::set<std::string> links{start};
  for (bool grows = true; grows;) {
    grows = false;
    for (const auto* j = robot.FirstChildElement("joint"); j != nullptr; j = j->NextSiblingElement("joint")) {
      if (j == &joint) continue;
      const std::string parent = j->FirstChildElement("parent")->Attribute("link");
      const std::string child = j->FirstChildElement("child")->Attribute("link");
      if (links.contains(parent) == links.contains(child)) continue;
      links.insert({parent, child});
      grows = true;
    }
  }
  return links;
}

/// Returns a checked number; 0 if it is missing.
double NumberOf(const XMLElement& element, const char* attribute) {
  const char* text = element.Attribute(attribute);
  return text == nullptr ? 0.0 : ParseNumber(text).value_or(0.0);
}

/// Returns true for a link without shape and mass.
bool IsBare(const XMLElement& link) {
  if (link.FirstChildElement("collision") != nullptr) return false;
  const XMLElement* inertial = link.FirstChildElement("inertial");
  const XMLElement* mass = inertial == nullptr ? nullptr : inertial->FirstChildElement("mass");
  return mass == nullptr || NumberOf(*mass, "value") == 0.0;
}

/// Removes everything above a joint that lets the robot move freely, if it has neither shape nor mass: legopt's base
/// moves freely anyway.
void RemoveFreeRoots(XMLElement* robot, UrdfFaults* faults) {
  const auto is_free = [](const XMLElement& joint) {
    const std::string_view type = joint.Attribute("type");
    return type == "floating" || type == "planar";
  };
  while (true) {
    XMLElement* free = robot->FirstChildElement("joint");
    while (free != nullptr && !is_free(*free)) free = free->NextSiblingElement("joint");
    if (free == nullptr) return;
    const std::string base = free->FirstChildElement("child")->Attribute("link");
    const std::set<std::string> above =
        LinksBefore(*robot, *free, free->FirstChildElement("parent")->Attribute("link"));
    std::vector<XMLElement*> removed;
    bool bare = !above.contains(base);
    for (auto* e = robot->FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      const bool link = e->Name() == std::string_view("link");
      const std::string place = link ? e->Attribute("name") : e->FirstChildElement("parent")->Attribute("link");
      if (!above.contains(place)) continue;
      bare = bare && (!link || IsBare(*e)) && (link || e == free || !is_free(*e));
      removed.push_back(e);
    }
    if (!bare) return;
    faults->Note(UrdfSeverity::kInfo, UrdfPlaceOf(*free, "robot"), free->Attribute("type"),
                 "is left out with its root link: the base, '" + PrintableUrdfText(base) + "', moves freely");
    for (XMLElement* e : removed) robot->DeleteChild(e);
  }
}

class UrdfCheck {
 public:
  UrdfCheck(const std::string& xml, const std::string& source) : xml_(xml), faults_(source) {
    checked_.source = source;
  }

  /// `meshes`: null, or where meshes are looked for if there are other faults.
  CheckedUrdf Run(const MeshPlaces* meshes) {
    XMLElement& given = Parse();
    NameRobot(&given);
    NoteLines(given);
    tinyxml2::XMLDocument copy;
    XMLElement* root = copy.NewElement("robot");
    copy.InsertEndChild(root);
    WalkUrdf(given, UrdfRobotRule(), "robot", root, &faults_);
    if (!IsConnectable(*root)) faults_.Check();
    RemoveFreeRoots(root, &faults_);
    checked_.robot = root->Attribute("name");
    CollectLinks(*root);
    CollectJoints(*root);
    if (connected_) CheckTree();
    if (faults_.refuses() && meshes != nullptr) CheckMeshes(*root, *meshes);
    faults_.Check();
    NoteVisualLinks(given);
    tinyxml2::XMLPrinter printer(nullptr, true);
    copy.Print(&printer);
    checked_.text = printer.CStr();
    checked_.notes = faults_.notes();
    return std::move(checked_);
  }

 private:
  [[noreturn]] void FailFile(const std::string& field, const std::string& message, const std::string& fix) const {
    throw InputError({checked_.source, field, "", message, fix});
  }

  XMLElement& Parse() {
    if (xml_.size() > kMostBytes) FailFile("", "has more than 16 MiB", "give the description of one robot");
    if (xml_.find('\0') != std::string::npos) FailFile("", "is no text: it has a byte 0", "save it as UTF-8");
    if (document_.Parse(xml_.c_str(), xml_.size()) != tinyxml2::XML_SUCCESS) {
      FailFile("line " + std::to_string(document_.ErrorLineNum()),
               std::string("not valid XML: ") + document_.ErrorName(), "correct the file");
    }
    XMLElement* root = document_.RootElement();
    if (root == nullptr || root->Name() != std::string_view("robot")) {
      FailFile("<robot>", "there is no <robot> element", "give a URDF file");
    }
    if (const XMLElement* second = root->NextSiblingElement()) {
      FailFile("line " + std::to_string(second->GetLineNum()), "a second element follows <robot>", "remove it");
    }
    return *root;
  }

  /// A robot without a name is named after its file.
  void NameRobot(XMLElement* robot) {
    const char* name = robot->Attribute("name");
    if (name != nullptr && *name != '\0') return;
    const std::string stem = std::filesystem::path(checked_.source).stem().string();
    robot->SetAttribute("name", stem.empty() ? "robot" : stem.c_str());
    faults_.Note(UrdfSeverity::kInfo, WithLine("robot: name", *robot), "", "missing; named after the file");
  }

  /// The copy has no line numbers.
  void NoteLines(const XMLElement& robot) {
    for (const auto* e = robot.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      if (HasText(e, "name")) lines_.emplace(UrdfPlaceOf(*e, "robot"), e->GetLineNum());
    }
  }

  /// Place of a link or joint of the copy, with its line in the file.
  std::string PlaceOf(const XMLElement& element) const {
    const std::string place = UrdfPlaceOf(element, "robot");
    const auto line = lines_.find(place);
    return line == lines_.end() ? place : place + ", line " + std::to_string(line->second);
  }

  void CheckTree() {
    try {
      CheckUrdfTree(checked_);
    } catch (const InputError& error) {
      for (const InputError::Fault& fault : error.faults()) {
        faults_.Refuse(fault.field, fault.value, fault.message, fault.fix);
      }
    }
  }

  void CheckMeshes(const XMLElement& robot, const MeshPlaces& meshes) {
    for (const auto* e = robot.FirstChildElement("link"); e != nullptr; e = e->NextSiblingElement("link")) {
      for (const auto* c = e->FirstChildElement("collision"); c != nullptr; c = c->NextSiblingElement("collision")) {
        const XMLElement* mesh = c->FirstChildElement("geometry")->FirstChildElement("mesh");
        if (HasText(mesh, "filename")) ResolveMesh(mesh->Attribute("filename"), e->Attribute("name"), meshes, &faults_);
      }
    }
  }

  /// Checks the rules that depend on the joint's type, which the table cannot express.
  void CheckJointType(const XMLElement& joint) {
    const std::string place = PlaceOf(joint);
    const std::string_view type = joint.Attribute("type");
    if (type == "floating" || type == "planar") {
      faults_.Refuse(place + ": type", type, "only the joint of a root link without shape and mass may have this type",
                     "use revolute, continuous, prismatic or fixed");
    }
    const XMLElement* limit = joint.FirstChildElement("limit");
    const bool limited = type == "revolute" || type == "prismatic";
    if (limit == nullptr && limited) {
      faults_.Refuse(place, "", "has no <limit>", "add lower and upper limits, or use type continuous");
    }
    if (limit != nullptr && limited && NumberOf(*limit, "lower") > NumberOf(*limit, "upper")) {
      faults_.Refuse(place + ": limit",
                     FormatGeneral(NumberOf(*limit, "lower"), 6) + " .. " + FormatGeneral(NumberOf(*limit, "upper"), 6),
                     "lower must not exceed upper", "swap or correct the limits");
    }
    const XMLElement* axis = joint.FirstChildElement("axis");
    if (type != "fixed" && HasText(axis, "xyz") && !HasDirection(axis->Attribute("xyz"))) {
      faults_.Refuse(place + ": axis", axis->Attribute("xyz"), "has no direction", "give a non-zero axis");
    }
  }

  static bool HasDirection(const char* text) {
    constexpr double kLeastNorm = 1e-6;
    ClassicInput numbers{std::string(text)};
    Eigen::Vector3d axis = Eigen::Vector3d::Zero();
    numbers >> axis.x() >> axis.y() >> axis.z();
    return axis.norm() >= kLeastNorm;
  }

  void NoteVisualLinks(const XMLElement& robot) {
    for (const auto* e = robot.FirstChildElement("link"); e != nullptr; e = e->NextSiblingElement("link")) {
      const auto link = std::ranges::find(checked_.links, e->Attribute("name"));
      if (link == checked_.links.end() || e->FirstChildElement("visual") == nullptr) continue;
      if (checked_.shapes[static_cast<std::size_t>(link - checked_.links.begin())] > 0) continue;
      faults_.Note(UrdfSeverity::kWarning, *link, "", "have a <visual>, but no <collision>: they never touch anything",
                   "copy their <visual> to a <collision> if they should");
    }
  }

  void CollectLinks(const XMLElement& robot) {
    for (const auto* e = robot.FirstChildElement("link"); e != nullptr; e = e->NextSiblingElement("link")) {
      const std::string name = e->Attribute("name");
      if (!names_.insert(name).second) RefuseConnection("link", name, "two links have this name", "rename one of them");
      checked_.links.push_back(name);
      std::size_t shapes = 0;
      std::vector<std::size_t>& capsules = checked_.capsules.emplace_back();
      const char* const kind = "collision";
      for (const auto* c = e->FirstChildElement(kind); c != nullptr; c = c->NextSiblingElement(kind)) {
        if (c->FirstChildElement("geometry")->FirstChildElement("capsule") != nullptr) capsules.push_back(shapes);
        ++shapes;
      }
      checked_.shapes.push_back(shapes);
    }
    if (checked_.links.empty()) FailFile("<robot>", "the robot has no links", "define at least one link");
    if (checked_.links.size() > kMostLinks) {
      throw InputError({checked_.source, "<robot>", std::to_string(checked_.links.size()) + " links",
                        "a robot may have " + std::to_string(kMostLinks) + " links", "leave out what does not move"});
    }
  }

  void CollectJoints(const XMLElement& robot) {
    std::set<std::string> joint_names;
    for (const auto* e = robot.FirstChildElement("joint"); e != nullptr; e = e->NextSiblingElement("joint")) {
      UrdfJointElement joint{
          .name = e->Attribute("name"), .parent = JointEnd(*e, "parent"), .child = JointEnd(*e, "child")};
      const XMLElement* mimic = e->FirstChildElement("mimic");
      if (mimic != nullptr && e->Attribute("type") != std::string_view("fixed")) {
        joint.leader = mimic->Attribute("joint");
        faults_.Note(UrdfSeverity::kInfo, UrdfPlaceOf(*e, "robot"), joint.leader,
                     "follows another joint; both are one degree of freedom");
      }
      CheckJointType(*e);
      if (!joint_names.insert(joint.name).second) {
        faults_.Refuse("joint", joint.name, "two joints have this name", "rename one of them");
      }
      const auto [other, fresh] = parent_joint_.emplace(joint.child, joint.name);
      if (!fresh) {
        RefuseConnection("link '" + PrintableUrdfText(joint.child) + "'",
                         PrintableUrdfText(other->second) + "' and '" + PrintableUrdfText(joint.name),
                         "is the child of two joints (a kinematic loop)", "remove one of the joints");
      }
      checked_.joints.push_back(std::move(joint));
    }
    CheckLeaders(robot);
  }

  /// Each chain of followers must end at a joint that moves independently.
  void CheckLeaders(const XMLElement& robot) {
    std::map<std::string, const UrdfJointElement*> by_name;
    std::set<std::string> fixed;
    for (const UrdfJointElement& joint : checked_.joints) by_name[joint.name] = &joint;
    for (const auto* e = robot.FirstChildElement("joint"); e != nullptr; e = e->NextSiblingElement("joint")) {
      if (e->Attribute("type") == std::string_view("fixed")) fixed.insert(e->Attribute("name"));
    }
    for (const UrdfJointElement& joint : checked_.joints) {
      std::string leader = joint.leader;
      const std::string place = "joint '" + PrintableUrdfText(joint.name) + "': mimic: joint";
      for (std::size_t steps = 0; !leader.empty(); ++steps) {
        if (!by_name.contains(leader) || fixed.contains(leader)) {
          faults_.Refuse(place, leader, by_name.contains(leader) ? "does not move" : "there is no such joint",
                         "name a joint that moves");
          break;
        }
        if (steps > checked_.joints.size()) {
          faults_.Refuse(place, joint.leader, "joints follow each other in a circle", "remove one <mimic>");
          break;
        }
        leader = by_name[leader]->leader;
      }
    }
  }

  std::string JointEnd(const XMLElement& joint, const char* end) {
    const std::string link = joint.FirstChildElement(end)->Attribute("link");
    if (!names_.contains(link)) {
      RefuseConnection(PlaceOf(joint), link, std::string(end) + " link does not exist",
                       "define the link or correct the name");
    }
    return link;
  }

  /// Adds a fault with which links and joints form no graph whose shape could be checked.
  void RefuseConnection(const std::string& place, const std::string& value, const std::string& message,
                        const std::string& fix) {
    connected_ = false;
    faults_.Refuse(place, value, message, fix);
  }

  const std::string& xml_;
  UrdfFaults faults_;
  CheckedUrdf checked_;
  tinyxml2::XMLDocument document_;
  std::set<std::string> names_;
  std::map<std::string, std::string> parent_joint_;  ///< keyed by child link
  std::map<std::string, int> lines_;                 ///< lines of links and joints in the file, by place
  bool connected_ = true;
};

}  // namespace

CheckedUrdf CheckUrdf(const std::string& xml, const std::string& source, const MeshPlaces* meshes) {
  return UrdfCheck(xml, source).Run(meshes);
}

std::string ResolveMesh(const std::string& name, const std::string& link, const MeshPlaces& places,
                        UrdfFaults* faults) {
  const std::optional<FoundMesh> mesh = FindMesh(name, places.folder, places.search.folders);
  const std::string place = "link '" + PrintableUrdfText(link) + "': mesh";
  if (!mesh) {
    if (places.search.allow_missing) return "";
    faults->Refuse(place, name, "there is no such mesh file",
                   "put it there, give its folder with --mesh-path, or import without it: --allow-missing-meshes");
    return name;
  }
  if (!mesh->fallback.empty()) {
    faults->Note(UrdfSeverity::kWarning, place, name, "the mesh file was found only " + mesh->fallback);
  }
  return mesh->path.string();
}

std::string ReadUrdfFile(const std::string& path) {
  std::string text = ReadFileText(path, kMostBytes);
  if (text.empty()) throw InputError({path, "", "", "the robot description is empty", "give a URDF"});
  return text;
}

namespace {

void AddName(const XMLElement& element, std::string* names) {
  *names += (names->empty() ? "" : ", ") + PrintableUrdfText(element.Attribute("name"));
}

/// Principal moments, ascending.
Eigen::Vector3d PrincipalMoments(const XMLElement& inertia) {
  const auto moment = [&inertia](const char* name) { return inertia.DoubleAttribute(name); };
  Eigen::Matrix3d tensor;
  tensor << moment("ixx"), moment("ixy"), moment("ixz"),  //
      moment("ixy"), moment("iyy"), moment("iyz"),        //
      moment("ixz"), moment("iyz"), moment("izz");
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(tensor, Eigen::EigenvaluesOnly).eigenvalues();
}

}  // namespace

std::vector<UrdfDiagnostic> ReviewUrdf(const CheckedUrdf& urdf) {
  constexpr double kRounding = 0.99;  // margin for tensors written with few digits
  const ClassicNumericLocale point;
  tinyxml2::XMLDocument document;
  document.Parse(urdf.text.c_str(), urdf.text.size());  // cannot fail: CheckUrdf wrote this text
  const XMLElement& robot = *document.RootElement();
  std::string without_axis, not_definite, not_a_body, limited;
  for (const auto* e = robot.FirstChildElement("joint"); e != nullptr; e = e->NextSiblingElement("joint")) {
    const bool moves = e->Attribute("type") != std::string_view("fixed");
    if (moves && e->FirstChildElement("axis") == nullptr) AddName(*e, &without_axis);
    const XMLElement* limit = e->FirstChildElement("limit");
    const bool has_range =
        limit != nullptr && (limit->DoubleAttribute("lower") != 0 || limit->DoubleAttribute("upper") != 0);
    if (has_range && e->Attribute("type") == std::string_view("continuous")) AddName(*e, &limited);
  }
  for (const auto* e = robot.FirstChildElement("link"); e != nullptr; e = e->NextSiblingElement("link")) {
    const XMLElement* inertial = e->FirstChildElement("inertial");
    if (inertial == nullptr || inertial->FirstChildElement("mass")->DoubleAttribute("value") == 0.0) continue;
    const Eigen::Vector3d moments = PrincipalMoments(*inertial->FirstChildElement("inertia"));
    if (!(moments[0] > 0.0)) {
      AddName(*e, &not_definite);
    } else if (!(moments[0] + moments[1] >= kRounding * moments[2])) {
      AddName(*e, &not_a_body);
    }
  }
  std::vector<UrdfDiagnostic> remarks;
  const auto add = [&](const std::string& field, const char* message, const char* fix) {
    if (!field.empty()) remarks.push_back({UrdfSeverity::kWarning, field, "", message, fix});
  };
  add(without_axis, "have no <axis>: they turn about, or move along, x", "write the axis");
  add(limited, "are continuous and have limits, which do not count", "use type revolute if they should");
  add(not_definite, "have an inertia that is not positive definite, which only durations of motions use", "correct it");
  add(not_a_body,
      "have a principal moment of inertia above the sum of the others, as no body can; only durations of motions use "
      "it",
      "correct it");
  return remarks;
}

}  // namespace legopt

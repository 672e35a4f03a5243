#include "legopt/import/internal/collada_robot.h"

#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "legopt/import/internal/collada_document.h"
#include "legopt/import/internal/degree.h"
#include "legopt/types/input_error.h"

namespace legopt {
namespace {

using tinyxml2::XMLElement;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr const char* kUrdfWriter = "URDF Collada Writer";  ///< value of <authoring_tool> that urdf_to_collada writes

/// Lower and upper limit as in the file: degrees or units of length.
using Limits = std::pair<double, double>;

/// Properties of one joint in the articulated systems.
struct AxisInfo {
  std::optional<Limits> limits;
  bool active = true;
  double velocity = 0.0;
  double effort = 0.0;
};

/// A <joint> of the kinematics model.
struct JointElement {
  const XMLElement* element = nullptr;
  const XMLElement* axis = nullptr;  ///< its <revolute> or <prismatic>
  std::string name;
  bool revolute = true;
};

class ColladaReader {
 public:
  explicit ColladaReader(const std::filesystem::path& path) : document_(path) {}

  ColladaRobot Read() {
    const XMLElement& model = TheModel();
    const char* name = model.Attribute("name");
    robot_.name = name != nullptr && *name != '\0' ? name : "robot";
    const XMLElement* technique = model.FirstChildElement("technique_common");
    if (technique == nullptr) document_.Fail(model, "", "has no <technique_common>", "export the file again");
    ReadJoints(*technique);
    ReadAxisInfos();
    const XMLElement* base = technique->FirstChildElement("link");
    if (base == nullptr) document_.Fail(*technique, "", "has no <link>", "export the file again");
    if (base->NextSiblingElement("link") != nullptr) {
      document_.Fail(*base->NextSiblingElement("link"), "", "a robot has one base link", "connect it by a joint");
    }
    AddLink(*base, -1, Eigen::Isometry3d::Identity());
    ReadMasses();
    ReadGeometry();
    return std::move(robot_);
  }

 private:
  const XMLElement& TheModel() const {
    const auto models = ColladaDocument::FindAll(document_.root(), "kinematics_model");
    if (models.size() == 1) return *models.front();
    throw InputError({document_.file(), "<kinematics_model>", std::to_string(models.size()),
                      models.empty() ? "the file describes no kinematics" : "the file holds several robots",
                      models.empty() ? "give a robot with joints, or a URDF" : "keep one of them"});
  }

  void ReadJoints(const XMLElement& technique) {
    for (const XMLElement* e = technique.FirstChildElement("joint"); e != nullptr; e = e->NextSiblingElement("joint")) {
      const std::string sid = document_.Attribute(*e, "sid");
      const char* name = e->Attribute("name");
      JointElement joint{.element = e, .axis = e->FirstChildElement("revolute"), .name = name != nullptr ? name : sid};
      joint.revolute = joint.axis != nullptr;
      if (joint.axis == nullptr) joint.axis = e->FirstChildElement("prismatic");
      if (joint.axis == nullptr) document_.Fail(*e, joint.name, "is neither revolute nor prismatic", "change its type");
      if (joint.axis->NextSiblingElement("revolute") != nullptr ||
          joint.axis->NextSiblingElement("prismatic") != nullptr) {
        document_.Fail(*e, joint.name, "moves about several axes", "split it into joints with one axis each");
      }
      if (!joints_.emplace(sid, joint).second)
        document_.Fail(*e, sid, "two joints have this sid", "rename one of them");
    }
  }

  std::optional<Limits> ReadLimits(const XMLElement& parent) const {
    const XMLElement* limits = parent.FirstChildElement("limits");
    if (limits == nullptr) return std::nullopt;
    return Limits(document_.Number(*limits, "min", -kInfinity), document_.Number(*limits, "max", kInfinity));
  }

  /// Reads the axis infos. Those of kinematics refer to "model/joint/axis", those of motion to the kinematic ones by
  /// sid.
  void ReadAxisInfos() {
    std::map<std::string, std::string> joint_of_info;
    for (const XMLElement* kinematics : ColladaDocument::FindAll(document_.root(), "kinematics")) {
      for (const XMLElement* info : ColladaDocument::FindAll(*kinematics, "axis_info")) {
        const std::string axis = document_.Attribute(*info, "axis");
        const std::string sid{LastPart(axis.substr(0, axis.find_last_of('/')))};
        if (!joints_.contains(sid)) document_.Fail(*info, axis, "there is no such joint", "export the file again");
        AxisInfo& known = infos_[sid];
        known.limits = ReadLimits(*info);
        known.active = document_.Flag(*info, "active", true) && !document_.Flag(*info, "locked", false);
        const char* own = info->Attribute("sid");
        if (own != nullptr) joint_of_info[own] = sid;
      }
    }
    for (const XMLElement* motion : ColladaDocument::FindAll(document_.root(), "motion")) {
      for (const XMLElement* info : ColladaDocument::FindAll(*motion, "axis_info")) {
        const auto joint = joint_of_info.find(std::string(LastPart(document_.Attribute(*info, "axis"))));
        if (joint == joint_of_info.end()) continue;
        infos_[joint->second].velocity = document_.Number(*info, "speed", 0.0);
        infos_[joint->second].effort = document_.Number(*info, "acceleration", 0.0);
      }
    }
  }

  void AddLink(const XMLElement& element, int parent_joint, const Eigen::Isometry3d& pose) {
    for (const char* loop : {"attachment_start", "attachment_end"}) {
      const XMLElement* found = element.FirstChildElement(loop);
      if (found != nullptr) document_.Fail(*found, "", "closed loops are not supported", "cut the loop");
    }
    const char* name = element.Attribute("name");
    const int index = static_cast<int>(robot_.links.size());
    ColladaLink& link = robot_.links.emplace_back();
    link.name = name != nullptr ? name : document_.Attribute(element, "sid");
    link.pose = pose;
    if (!link_names_.emplace(link.name, index).second) {
      document_.Fail(element, link.name, "two links have this name", "rename one of them");
    }
    if (parent_joint >= 0) robot_.joints[static_cast<size_t>(parent_joint)].joint.child_link = index;
    for (const XMLElement* e = element.FirstChildElement("attachment_full"); e != nullptr;
         e = e->NextSiblingElement("attachment_full")) {
      AddChild(*e, index, pose);
    }
  }

  void AddChild(const XMLElement& attachment, int parent, const Eigen::Isometry3d& parent_pose) {
    const std::string reference = document_.Attribute(attachment, "joint");
    const auto found = joints_.find(std::string(LastPart(reference)));
    if (found == joints_.end())
      document_.Fail(attachment, reference, "there is no such joint", "export the file again");
    const XMLElement* child = attachment.FirstChildElement("link");
    if (child == nullptr) document_.Fail(attachment, "", "has no <link>", "export the file again");
    const AxisInfo info = infos_.contains(found->first) ? infos_[found->first] : AxisInfo{};
    ColladaJoint joint = MakeJoint(found->second, info);
    joint.joint.origin = document_.Transform(attachment);
    joint.joint.parent_link = parent;
    const Eigen::Isometry3d pose = parent_pose * joint.joint.origin;
    robot_.joints.push_back(std::move(joint));
    AddLink(*child, static_cast<int>(robot_.joints.size()) - 1, pose);
  }

  ColladaJoint MakeJoint(const JointElement& element, const AxisInfo& info) {
    ColladaJoint result{.joint = {}, .effort = info.effort, .velocity = info.velocity};
    Joint& joint = result.joint;
    joint.name = element.name;
    const XMLElement* axis = element.axis->FirstChildElement("axis");
    if (axis == nullptr) document_.Fail(*element.axis, element.name, "has no <axis>", "add it");
    const std::vector<double> a = document_.Numbers(*axis, 3);
    const std::optional<Limits> limits = info.limits ? info.limits : ReadLimits(*element.axis);
    const bool rigid = limits && limits->first == limits->second;
    if (!info.active || rigid) {
      if (!rigid) NotePassive(element);
      return result;
    }
    joint.axis = Eigen::Vector3d(a[0], a[1], a[2]);
    if (!(joint.axis.norm() > 0.0)) document_.Fail(*axis, element.name, "has no direction", "give a non-zero axis");
    joint.axis.normalize();
    const double unit = element.revolute ? kDegree : document_.unit_m();
    joint.lower = limits ? unit * limits->first : -kInfinity;
    joint.upper = limits ? unit * limits->second : kInfinity;
    const bool limited = std::isfinite(joint.lower) && std::isfinite(joint.upper);
    if (!limited && !element.revolute) {
      document_.Fail(*element.element, element.name, "a prismatic joint needs limits", "add them");
    }
    if (joint.lower > joint.upper) {
      document_.Fail(*element.element, element.name, "the lower limit exceeds the upper one", "exchange them");
    }
    joint.type = !element.revolute ? JointType::kPrismatic : limited ? JointType::kRevolute : JointType::kContinuous;
    return result;
  }

  void NotePassive(const JointElement& element) {
    robot_.findings.push_back({.severity = DatasetDiagnostic::Severity::kWarning,
                               .check = "passive joints",
                               .file = document_.file(),
                               .field = "joint '" + element.name + "'",
                               .value = "",
                               .message = "moves in the file but is not active (a mimic joint?); it becomes fixed at 0",
                               .fix = "set <active> in its <axis_info> if it has a motor"});
  }

  void ReadMasses() {
    const XMLElement* tool = ColladaDocument::FindFirst(document_.root(), "authoring_tool");
    const bool transposed = tool != nullptr && tool->GetText() != nullptr &&
                            std::string_view(tool->GetText()).find(kUrdfWriter) != std::string_view::npos;
    for (const XMLElement* model : ColladaDocument::FindAll(document_.root(), "physics_model")) {
      for (const XMLElement* body : ColladaDocument::FindAll(*model, "rigid_body")) {
        const char* name = body->Attribute("name");
        const XMLElement* technique = body->FirstChildElement("technique_common");
        const auto link = link_names_.find(name != nullptr ? name : "");
        if (link == link_names_.end() || technique == nullptr) continue;  // a body of something other than the robot
        ReadMass(*technique, transposed, &robot_.links[static_cast<size_t>(link->second)]);
      }
    }
  }

  void ReadMass(const XMLElement& technique, bool transposed, ColladaLink* link) const {
    link->mass = document_.Number(technique, "mass", 0.0);
    if (link->mass < 0.0) document_.Fail(technique, std::to_string(link->mass), "the mass is negative", "correct it");
    const XMLElement* frame = technique.FirstChildElement("mass_frame");
    if (frame == nullptr) return;
    const Eigen::Isometry3d in_link = link->pose.inverse() * document_.Transform(*frame);
    link->com = in_link.translation();
    const XMLElement* inertia = technique.FirstChildElement("inertia");
    if (inertia == nullptr) return;
    const std::vector<double> principal = document_.Numbers(*inertia, 3);
    const Eigen::Matrix3d axes =
        transposed ? Eigen::Matrix3d(in_link.linear().transpose()) : Eigen::Matrix3d(in_link.linear());
    link->inertia = axes * Eigen::Vector3d(principal[0], principal[1], principal[2]).asDiagonal() * axes.transpose();
  }

  void ReadGeometry() {
    std::vector<std::string> names;
    for (const ColladaLink& link : robot_.links) names.push_back(link.name);
    const ColladaScene scene(document_, names, names.front());
    for (ColladaLink& link : robot_.links) link.geometries = scene.GeometryOf(link.name, link.pose);
  }

  ColladaDocument document_;
  std::map<std::string, JointElement> joints_;  ///< keyed by sid
  std::map<std::string, AxisInfo> infos_;       ///< keyed by the joint's sid
  std::map<std::string, int> link_names_;
  ColladaRobot robot_;
};

}  // namespace

ColladaRobot ReadColladaRobot(const std::filesystem::path& path) { return ColladaReader(path).Read(); }

}  // namespace legopt

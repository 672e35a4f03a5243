// URDF files become RobotModels: urdfdom reads the elements, the document's own order of joints gives the tree order.

#include <console_bridge/console.h>
#include <tinyxml2.h>
#include <urdf_parser/urdf_parser.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <mutex>
#include <sstream>
#include <utility>

#include "legopt/input_error.h"
#include "legopt/robot/robot_model.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;

constexpr double kMinAxisNorm = 1e-6;

/// Collects what urdfdom logs, so that it becomes part of an error instead of going to the terminal.
class LogCapture : public console_bridge::OutputHandler {
 public:
  LogCapture() { console_bridge::useOutputHandler(this); }
  ~LogCapture() override { console_bridge::restorePreviousOutputHandler(); }
  LogCapture(const LogCapture&) = delete;
  LogCapture& operator=(const LogCapture&) = delete;
  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    if (level < console_bridge::CONSOLE_BRIDGE_LOG_ERROR) return;
    if (!text_.empty()) text_ += "; ";
    text_ += text;
  }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

struct JointElement {
  std::string name, parent, child;
};

class UrdfReader {
 public:
  UrdfReader(const std::string& xml, std::string source, fs::path mesh_folder)
      : source_(std::move(source)), mesh_folder_(std::move(mesh_folder)) {
    ReadJointOrder(xml);
    CheckTree();
    ParseWithUrdfdom(xml);
  }

  RobotModel Build() {
    AddLink(root_);
    return RobotModel(urdf_->getName(), std::move(links_), std::move(joints_));
  }

 private:
  [[noreturn]] void Fail(const std::string& field, const std::string& value, const std::string& message,
                         const std::string& fix) const {
    throw InputError({source_, field, value, message, fix});
  }

  void ReadJointOrder(const std::string& xml) {
    tinyxml2::XMLDocument document;
    if (document.Parse(xml.c_str(), xml.size()) != tinyxml2::XML_SUCCESS) {
      Fail("line " + std::to_string(document.ErrorLineNum()), "", std::string("not valid XML: ") + document.ErrorName(),
           "correct the file");
    }
    const tinyxml2::XMLElement* robot = document.FirstChildElement("robot");
    if (robot == nullptr) Fail("<robot>", "", "there is no <robot> element", "give a URDF file");
    for (const auto* e = robot->FirstChildElement("link"); e != nullptr; e = e->NextSiblingElement("link")) {
      const std::string name = Attribute(*e, "name", "link");
      if (!link_names_.emplace(name, 0).second) Fail("link", name, "two links have this name", "rename one of them");
      link_order_.push_back(name);
    }
    for (const auto* e = robot->FirstChildElement("joint"); e != nullptr; e = e->NextSiblingElement("joint")) {
      JointElement joint;
      joint.name = Attribute(*e, "name", "joint");
      joint.parent = JointEnd(*e, "parent", joint.name);
      joint.child = JointEnd(*e, "child", joint.name);
      CheckJointElement(*e, joint);
      joint_elements_.push_back(std::move(joint));
    }
  }

  std::string Attribute(const tinyxml2::XMLElement& element, const char* key, const char* what) const {
    const char* value = element.Attribute(key);
    if (value == nullptr || *value == '\0') {
      Fail("line " + std::to_string(element.GetLineNum()), "", std::string("<") + what + "> without '" + key + "'",
           "add the attribute");
    }
    return value;
  }

  std::string JointEnd(const tinyxml2::XMLElement& joint, const char* end, const std::string& name) const {
    const tinyxml2::XMLElement* element = joint.FirstChildElement(end);
    if (element == nullptr) Fail("joint '" + name + "'", "", std::string("no <") + end + "> element", "add it");
    std::string link = Attribute(*element, "link", end);
    if (!link_names_.contains(link)) {
      Fail("joint '" + name + "'", link, std::string(end) + " link does not exist",
           "define the link or correct the name");
    }
    return link;
  }

  void CheckJointElement(const tinyxml2::XMLElement& element, const JointElement& joint) const {
    const std::string type = Attribute(element, "type", "joint");
    if (type != "revolute" && type != "continuous" && type != "prismatic" && type != "fixed") {
      Fail("joint '" + joint.name + "'", type, "joint type is not supported",
           "use revolute, continuous, prismatic or fixed");
    }
    if (element.FirstChildElement("mimic") != nullptr) {
      Fail("joint '" + joint.name + "'", "mimic", "mimic joints are not supported",
           "make the joint fixed or independent");
    }
    for (const JointElement& other : joint_elements_) {
      if (other.name == joint.name) Fail("joint", joint.name, "two joints have this name", "rename one of them");
      if (other.child == joint.child) {
        Fail("link '" + joint.child + "'", "",
             "is the child of two joints, '" + other.name + "' and '" + joint.name + "' (a kinematic loop)",
             "remove one of the joints");
      }
    }
  }

  /// Exactly one root, and every link reachable from it.
  void CheckTree() {
    if (link_order_.empty()) Fail("<robot>", "", "the robot has no links", "define at least one link");
    std::map<std::string, bool> is_child;
    for (const JointElement& joint : joint_elements_) is_child[joint.child] = true;
    for (const std::string& link : link_order_) {
      if (is_child.contains(link)) continue;
      if (!root_.empty()) {
        Fail("link '" + link + "'", "", "is not connected: the robot also has the root link '" + root_ + "'",
             "connect it by a joint or remove it");
      }
      root_ = link;
    }
    if (root_.empty()) {
      Fail("<robot>", "", "every link is the child of a joint (a kinematic loop)",
           "remove the joint that closes the loop");
    }
    // With one root and at most one parent per link, what is not reachable lies on a loop.
    size_t reached = 0;
    std::vector<std::string> open{root_};
    while (!open.empty()) {
      const std::string link = open.back();
      open.pop_back();
      ++reached;
      for (const JointElement& joint : joint_elements_) {
        if (joint.parent == link) open.push_back(joint.child);
        if (joint.parent == link) link_names_[joint.child] = 1;
      }
    }
    if (reached == link_order_.size()) return;
    for (const std::string& link : link_order_) {
      if (link != root_ && link_names_[link] == 0) {
        Fail("link '" + link + "'", "", "lies on a kinematic loop that is not connected to the root '" + root_ + "'",
             "remove the joint that closes the loop");
      }
    }
  }

  void ParseWithUrdfdom(const std::string& xml) {
    static std::mutex mutex;  // urdfdom's log handler is global to the process
    const std::lock_guard<std::mutex> lock(mutex);
    LogCapture log;
    try {
      urdf_ = urdf::parseURDF(xml);
    } catch (const std::exception& error) {
      Fail("<robot>", "", std::string("urdfdom: ") + error.what(), "correct the file");
    }
    if (urdf_ == nullptr) {
      Fail("<robot>", "", "urdfdom refuses the file" + (log.text().empty() ? "" : ": " + log.text()),
           "correct the file");
    }
  }

  static Eigen::Isometry3d ToEigen(const urdf::Pose& pose) {
    Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
    const Eigen::Quaterniond rotation(pose.rotation.w, pose.rotation.x, pose.rotation.y, pose.rotation.z);
    result.linear() = rotation.normalized().toRotationMatrix();
    result.translation() << pose.position.x, pose.position.y, pose.position.z;
    return result;
  }

  void AddLink(const std::string& name) {
    const urdf::LinkConstSharedPtr source = urdf_->getLink(name);
    if (source == nullptr) Fail("link '" + name + "'", "", "urdfdom did not read it", "correct the element");
    const int index = static_cast<int>(links_.size());
    links_.push_back(MakeLink(*source));
    for (const JointElement& element : joint_elements_) {
      if (element.parent != name) continue;
      Joint joint = MakeJoint(element.name);
      joint.parent_link = index;
      joint.child_link = static_cast<int>(links_.size());
      joints_.push_back(joint);
      AddLink(element.child);
    }
  }

  Link MakeLink(const urdf::Link& source) const {
    Link link;
    link.name = source.name;
    if (source.inertial != nullptr) {
      link.mass = source.inertial->mass;
      link.com = ToEigen(source.inertial->origin).translation();
      if (!(link.mass >= 0.0) || !std::isfinite(link.mass) || !link.com.allFinite()) {
        Fail("link '" + link.name + "': inertial", std::to_string(link.mass), "mass must be finite and not negative",
             "correct the mass and the origin");
      }
    }
    for (const urdf::CollisionSharedPtr& collision : source.collision_array) {
      if (collision == nullptr || collision->geometry == nullptr) continue;
      link.collision.push_back(MakeShape(*collision, link.name));
    }
    return link;
  }

  ShapeSpec MakeShape(const urdf::Collision& collision, const std::string& link) const {
    ShapeSpec shape;
    shape.pose = ToEigen(collision.origin);
    switch (collision.geometry->type) {
      case urdf::Geometry::BOX: {
        const auto& box = static_cast<const urdf::Box&>(*collision.geometry);
        shape.kind = ShapeSpec::Kind::kBox;
        shape.size << box.dim.x, box.dim.y, box.dim.z;
        break;
      }
      case urdf::Geometry::SPHERE:
        shape.kind = ShapeSpec::Kind::kSphere;
        shape.size.setConstant(static_cast<const urdf::Sphere&>(*collision.geometry).radius);
        break;
      case urdf::Geometry::CYLINDER: {
        const auto& cylinder = static_cast<const urdf::Cylinder&>(*collision.geometry);
        shape.kind = ShapeSpec::Kind::kCylinder;
        shape.size << cylinder.radius, cylinder.radius, cylinder.length;
        break;
      }
      case urdf::Geometry::MESH: {
        const auto& mesh = static_cast<const urdf::Mesh&>(*collision.geometry);
        shape.kind = ShapeSpec::Kind::kMesh;
        shape.mesh_file = ResolveMesh(mesh.filename, link);
        shape.scale << mesh.scale.x, mesh.scale.y, mesh.scale.z;
        shape.size.setOnes();
        break;
      }
    }
    if (!shape.size.allFinite() || shape.size.minCoeff() <= 0.0 || !shape.pose.matrix().allFinite()) {
      Fail("link '" + link + "': collision", "", "sizes must be positive and finite", "correct the geometry");
    }
    return shape;
  }

  std::string ResolveMesh(const std::string& name, const std::string& link) const {
    constexpr std::string_view kPackage = "package://";
    constexpr std::string_view kFile = "file://";
    fs::path path;
    if (name.starts_with(kPackage)) {
      const fs::path inside = name.substr(kPackage.size());
      for (fs::path folder = fs::absolute(mesh_folder_).lexically_normal();; folder = folder.parent_path()) {
        path = folder / inside;
        if (fs::exists(path) || folder == folder.parent_path()) break;
      }
    } else {
      path = name.starts_with(kFile) ? fs::path(name.substr(kFile.size())) : fs::path(name);
      if (path.is_relative()) path = mesh_folder_ / path;
    }
    std::error_code ignored;
    if (!fs::is_regular_file(path, ignored)) {
      Fail("link '" + link + "': mesh", name, "there is no such mesh file", "put it there or correct the filename");
    }
    return fs::absolute(path).lexically_normal().string();
  }

  Joint MakeJoint(const std::string& name) const {
    const urdf::JointConstSharedPtr source = urdf_->getJoint(name);
    const std::string field = "joint '" + name + "'";
    if (source == nullptr) Fail(field, "", "urdfdom did not read it", "correct the element");
    Joint joint;
    joint.name = name;
    joint.origin = ToEigen(source->parent_to_joint_origin_transform);
    if (!joint.origin.matrix().allFinite()) Fail(field + ": origin", "", "is not finite", "correct the numbers");
    joint.type = source->type == urdf::Joint::FIXED        ? JointType::kFixed
                 : source->type == urdf::Joint::PRISMATIC  ? JointType::kPrismatic
                 : source->type == urdf::Joint::CONTINUOUS ? JointType::kContinuous
                                                           : JointType::kRevolute;
    if (joint.type == JointType::kFixed) return joint;
    joint.axis << source->axis.x, source->axis.y, source->axis.z;
    if (!joint.axis.allFinite() || joint.axis.norm() < kMinAxisNorm) {
      Fail(field + ": axis", "", "has no direction", "give a non-zero axis");
    }
    joint.axis.normalize();
    joint.lower = -std::numeric_limits<double>::infinity();
    joint.upper = std::numeric_limits<double>::infinity();
    if (joint.type == JointType::kContinuous) return joint;
    if (source->limits == nullptr) {
      Fail(field, "", "has no <limit>", "add lower and upper limits, or use type continuous");
    }
    joint.lower = source->limits->lower;
    joint.upper = source->limits->upper;
    if (!(joint.lower <= joint.upper)) {
      Fail(field + ": limit", std::to_string(joint.lower) + " .. " + std::to_string(joint.upper),
           "lower must not exceed upper", "swap or correct the limits");
    }
    return joint;
  }

  std::string source_;
  fs::path mesh_folder_;
  std::map<std::string, int> link_names_;  ///< value: 1 when some joint reaches the link from the root's side
  std::vector<std::string> link_order_;
  std::vector<JointElement> joint_elements_;
  std::string root_;
  urdf::ModelInterfaceSharedPtr urdf_;
  std::vector<Link> links_;
  std::vector<Joint> joints_;
};

}  // namespace

RobotModel RobotModel::FromUrdfFile(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  if (file) text << file.rdbuf();
  if (!file || text.str().empty()) {
    throw InputError({path, "", "", "cannot read the robot description", "check the path and its permissions"});
  }
  return FromUrdfText(text.str(), path, fs::path(path).parent_path().string());
}

RobotModel RobotModel::FromUrdfText(const std::string& xml, const std::string& source, const std::string& mesh_folder) {
  return UrdfReader(xml, source, mesh_folder).Build();
}

}  // namespace legopt

#include "legopt/robot/internal/urdf_reader.h"

#include <console_bridge/console.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <mutex>
#include <string_view>
#include <system_error>
#include <unordered_map>
#include <utility>
#include <vector>

#include "legopt/robot/internal/mesh_lookup.h"
#include "legopt/robot/internal/urdf_check.h"
#include "legopt/robot/robot_model.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"

namespace legopt {
namespace {

/// Captures urdfdom's log, so that it becomes part of an error instead of being printed on the terminal.
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

/// Mutex held while urdfdom runs: its log handler is global to the process.
std::mutex& UrdfdomMutex() {
  static std::mutex mutex;
  return mutex;
}

[[noreturn]] void RefuseContent(const CheckedUrdf& urdf, const std::string& field, const std::string& message) {
  throw InputError({urdf.source, field, "", message, "correct the element"});
}

Eigen::Isometry3d ToEigen(const urdf::Pose& pose) {
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  const Eigen::Quaterniond rotation(pose.rotation.w, pose.rotation.x, pose.rotation.y, pose.rotation.z);
  result.linear() = rotation.normalized().toRotationMatrix();
  result.translation() << pose.position.x, pose.position.y, pose.position.z;
  return result;
}

ShapeSpec MakeShape(const urdf::Collision& collision) {
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
      shape.mesh_file = mesh.filename;
      shape.scale << mesh.scale.x, mesh.scale.y, mesh.scale.z;
      shape.size.setOnes();
      break;
    }
  }
  return shape;
}

Link MakeLink(const urdf::Link& source) {
  Link link;
  link.name = source.name;
  if (source.inertial != nullptr) {
    link.mass = source.inertial->mass;
    const Eigen::Isometry3d frame = ToEigen(source.inertial->origin);
    link.com = frame.translation();
    const urdf::Inertial& i = *source.inertial;
    Eigen::Matrix3d tensor;
    tensor << i.ixx, i.ixy, i.ixz,  //
        i.ixy, i.iyy, i.iyz,        //
        i.ixz, i.iyz, i.izz;
    link.inertia = frame.linear() * tensor * frame.linear().transpose();
  }
  for (const urdf::CollisionSharedPtr& collision : source.collision_array) {
    if (collision != nullptr && collision->geometry != nullptr) link.collision.push_back(MakeShape(*collision));
  }
  return link;
}

Joint MakeJoint(const urdf::Joint& source) {
  Joint joint;
  joint.name = source.name;
  joint.origin = ToEigen(source.parent_to_joint_origin_transform);
  joint.type = source.type == urdf::Joint::FIXED        ? JointType::kFixed
               : source.type == urdf::Joint::PRISMATIC  ? JointType::kPrismatic
               : source.type == urdf::Joint::CONTINUOUS ? JointType::kContinuous
                                                        : JointType::kRevolute;
  if (joint.type == JointType::kFixed) return joint;
  joint.axis << source.axis.x, source.axis.y, source.axis.z;
  if (source.mimic != nullptr) {
    joint.multiplier = source.mimic->multiplier;
    joint.offset = source.mimic->offset;
  }
  joint.lower = -std::numeric_limits<double>::infinity();
  joint.upper = std::numeric_limits<double>::infinity();
  if (source.limits == nullptr) return joint;
  // Many files have 0 where a limit is not known.
  if (source.limits->effort > 0.0) joint.effort = source.limits->effort;
  if (source.limits->velocity > 0.0) joint.velocity = source.limits->velocity;
  if (joint.type == JointType::kContinuous) return joint;
  joint.lower = source.limits->lower;
  joint.upper = source.limits->upper;
  return joint;
}

/// urdfdom 3 does not read capsules, which have the attributes of cylinders.
std::string WithoutCapsules(std::string text) {
  constexpr std::string_view kCapsule = "<capsule ";
  for (std::size_t at; (at = text.find(kCapsule)) != std::string::npos;) {
    text.replace(at, kCapsule.size(), "<cylinder ");
  }
  return text;
}

urdf::ModelInterfaceSharedPtr Parse(const CheckedUrdf& urdf) {
  const std::lock_guard<std::mutex> lock(UrdfdomMutex());
  LogCapture log;
  urdf::ModelInterfaceSharedPtr model;
  try {
    const ClassicNumericLocale point;
    model = urdf::parseURDF(WithoutCapsules(urdf.text));
  } catch (const std::exception& error) {
    RefuseContent(urdf, "<robot>", std::string("urdfdom: ") + error.what());
  }
  if (!log.text().empty()) RefuseContent(urdf, "<robot>", "urdfdom: " + log.text());
  if (model == nullptr) RefuseContent(urdf, "<robot>", "urdfdom refuses the file");
  return model;
}

}  // namespace

UrdfContent ReadByUrdfdom(const CheckedUrdf& urdf) {
  const urdf::ModelInterfaceSharedPtr model = Parse(urdf);
  UrdfContent content;
  for (const std::string& name : urdf.links) {
    const urdf::LinkConstSharedPtr link = model->getLink(name);
    if (link == nullptr) RefuseContent(urdf, "link '" + name + "'", "urdfdom did not read it");
    content.links.push_back(MakeLink(*link));
    if (content.links.back().collision.size() != urdf.shapes[content.links.size() - 1]) {
      RefuseContent(urdf, "link '" + name + "': collision", "urdfdom did not read all of them");
    }
    for (const std::size_t shape : urdf.capsules[content.links.size() - 1]) {
      content.links.back().collision[shape].kind = ShapeSpec::Kind::kCapsule;
    }
  }
  for (const UrdfJointElement& element : urdf.joints) {
    const urdf::JointConstSharedPtr joint = model->getJoint(element.name);
    if (joint == nullptr) RefuseContent(urdf, "joint '" + element.name + "'", "urdfdom did not read it");
    content.joints.push_back(MakeJoint(*joint));
  }
  return content;
}

namespace {

namespace fs = std::filesystem;

[[noreturn]] void Refuse(const CheckedUrdf& urdf, const std::string& field, const std::string& value,
                         const std::string& message, const std::string& fix) {
  throw InputError({urdf.source, field, value, message, fix});
}

/// Links and joints by their indices in the file.
struct TreeIndex {
  explicit TreeIndex(const CheckedUrdf& urdf) : joints_of(urdf.links.size()) {
    std::unordered_map<std::string, std::size_t> index;
    for (std::size_t i = 0; i < urdf.links.size(); ++i) index[urdf.links[i]] = i;
    for (const UrdfJointElement& joint : urdf.joints) {
      joints_of[index[joint.parent]].push_back(child.size());
      child.push_back(index[joint.child]);
    }
  }

  std::vector<std::vector<std::size_t>> joints_of;  ///< per parent link, in the order of the file
  std::vector<std::size_t> child;                   ///< child link of each joint
};

/// Returns the only link that is no joint's child.
std::size_t FindRoot(const CheckedUrdf& urdf, const TreeIndex& tree) {
  std::vector<bool> is_child(urdf.links.size(), false);
  for (const std::size_t link : tree.child) is_child[link] = true;
  const auto root = std::find(is_child.begin(), is_child.end(), false);
  if (root == is_child.end()) {
    Refuse(urdf, "<robot>", "", "every link is the child of a joint (a kinematic loop)",
           "remove the joint that closes the loop");
  }
  const auto second = std::find(root + 1, is_child.end(), false);
  const auto name = [&](auto place) { return urdf.links[static_cast<std::size_t>(place - is_child.begin())]; };
  if (second != is_child.end()) {
    Refuse(urdf, "link '" + name(second) + "'", "",
           "is not connected: the robot also has the root link '" + name(root) + "'",
           "connect it by a joint or remove it");
  }
  return static_cast<std::size_t>(root - is_child.begin());
}

class TreeBuilder {
 public:
  TreeBuilder(const CheckedUrdf& urdf, const UrdfContent& content, const fs::path& mesh_folder,
              const MeshSearch& meshes)
      : urdf_(urdf),
        content_(content),
        meshes_{fs::absolute(mesh_folder).lexically_normal(), meshes},
        tree_(urdf),
        faults_(urdf.source) {}

  /// `notes` receives the meshes that were found by fallbacks; may be null.
  RobotModel Build(std::vector<UrdfDiagnostic>* notes) {
    AddLinks(FindRoot(urdf_, tree_));
    ResolveLeaders();
    faults_.Check();
    if (notes != nullptr) {
      for (UrdfDiagnostic& note : faults_.notes()) notes->push_back(std::move(note));
    }
    RobotModel robot(urdf_.robot, std::move(links_), std::move(joints_));
    CheckCommonLimits(robot);
    return robot;
  }

 private:
  void Fail(const std::string& field, const std::string& value, const std::string& message, const std::string& fix) {
    faults_.Refuse(field, value, message, fix);
  }

  /// Sets the leaders of all followers; a follower of a follower gets the leader of both, which exists (CheckUrdf).
  void ResolveLeaders() {
    std::unordered_map<std::string, std::size_t> index;
    for (std::size_t j = 0; j < joints_.size(); ++j) index[joints_[j].name] = j;
    const std::vector<Joint> given = joints_;
    for (std::size_t j = 0; j < joints_.size(); ++j) {
      for (std::size_t at = j; !leaders_[at].empty();) {
        at = index.at(leaders_[at]);
        joints_[j].leader = static_cast<int>(at);
        if (leaders_[at].empty()) break;
        joints_[j].offset += joints_[j].multiplier * given[at].offset;
        joints_[j].multiplier *= given[at].multiplier;
      }
    }
  }

  /// Throws if the limits of a joint and of those that follow it have no common value.
  void CheckCommonLimits(const RobotModel& robot) {
    for (const Joint& joint : robot.joints()) {
      const bool still = joint.leader >= 0 && joint.multiplier == 0.0;
      if (!still || (joint.lower <= joint.offset && joint.offset <= joint.upper)) continue;
      Fail("joint '" + joint.name + "': mimic: offset", std::to_string(joint.offset),
           "is outside of the joint's limits, and the multiplier is 0", "correct the offset or the limits");
    }
    for (int dof = 0; dof < robot.num_dofs(); ++dof) {
      if (robot.lower_limits()[dof] <= robot.upper_limits()[dof]) continue;
      Fail("joint '" + robot.joints()[static_cast<std::size_t>(robot.dof_joint(dof))].name + "': limit", "",
           "its limits and those of the joints that follow it have no common value",
           "correct the limits, or multiplier and offset of <mimic>");
    }
    faults_.Check();
  }

  /// Adds the links depth-first, children in the order of the joints. A loop, because a chain may be deeper than the
  /// stack.
  void AddLinks(std::size_t root) {
    std::vector<std::size_t> waiting_joints;
    std::vector<int> parent_index(urdf_.joints.size(), -1);
    const auto add_link = [&](std::size_t source) {
      const int index = static_cast<int>(links_.size());
      links_.push_back(Finished(content_.links[source]));
      const std::vector<std::size_t>& joints = tree_.joints_of[source];
      for (auto j = joints.rbegin(); j != joints.rend(); ++j) {
        waiting_joints.push_back(*j);
        parent_index[*j] = index;
      }
    };
    add_link(root);
    while (!waiting_joints.empty()) {
      const std::size_t j = waiting_joints.back();
      waiting_joints.pop_back();
      Joint joint = Finished(content_.joints[j]);
      leaders_.push_back(urdf_.joints[j].leader);
      joint.parent_link = parent_index[j];
      joint.child_link = static_cast<int>(links_.size());
      joints_.push_back(std::move(joint));
      add_link(tree_.child[j]);
    }
  }

  Link Finished(Link link) {
    if (!(link.mass >= 0.0) || !std::isfinite(link.mass) || !link.com.allFinite() || !link.inertia.allFinite()) {
      Fail("link '" + link.name + "': inertial", std::to_string(link.mass), "mass must be finite and not negative",
           "correct the mass, the origin and the inertia");
    }
    for (ShapeSpec& shape : link.collision) {
      if (!shape.size.allFinite() || shape.size.minCoeff() <= 0.0 || !shape.pose.matrix().allFinite()) {
        Fail("link '" + link.name + "': collision", "", "sizes must be positive and finite", "correct the geometry");
      }
      if (shape.kind == ShapeSpec::Kind::kMesh)
        shape.mesh_file = ResolveMesh(shape.mesh_file, link.name, meshes_, &faults_);
    }
    return link;
  }

  Joint Finished(Joint joint) {
    const std::string field = "joint '" + joint.name + "'";
    if (!joint.origin.matrix().allFinite()) Fail(field + ": origin", "", "is not finite", "correct the numbers");
    if (joint.type == JointType::kFixed) return joint;
    joint.axis.normalize();
    return joint;
  }

  const CheckedUrdf& urdf_;
  const UrdfContent& content_;
  MeshPlaces meshes_;
  TreeIndex tree_;
  UrdfFaults faults_;
  std::vector<Link> links_;
  std::vector<Joint> joints_;
  std::vector<std::string> leaders_;  ///< per joint, name of the one that it follows
};

}  // namespace

void CheckUrdfTree(const CheckedUrdf& urdf) {
  const TreeIndex tree(urdf);
  const std::size_t root = FindRoot(urdf, tree);
  std::vector<bool> reached(urdf.links.size(), false);
  std::vector<std::size_t> open{root};
  while (!open.empty()) {
    const std::size_t link = open.back();
    open.pop_back();
    reached[link] = true;
    for (const std::size_t joint : tree.joints_of[link]) open.push_back(tree.child[joint]);
  }
  // With one root and at most one parent per link, a link that cannot be reached lies on a loop.
  const auto lost = std::find(reached.begin(), reached.end(), false);
  if (lost == reached.end()) return;
  Refuse(urdf, "link '" + urdf.links[static_cast<std::size_t>(lost - reached.begin())] + "'", "",
         "lies on a kinematic loop that is not connected to the root '" + urdf.links[root] + "'",
         "remove the joint that closes the loop");
}

RobotModel BuildUrdfTree(const CheckedUrdf& urdf, const UrdfContent& content, const std::string& mesh_folder,
                         std::vector<UrdfDiagnostic>* notes, const MeshSearch& meshes) {
  return TreeBuilder(urdf, content, mesh_folder, meshes).Build(notes);
}

// Conversion of URDF files to RobotModels: the file is checked, urdfdom reads its elements, and the joint order of the
// document gives the order of the tree.

RobotModel RobotModel::FromUrdfFile(const std::string& path, const ReadGuard& guard) {
  return FromUrdfText(ReadUrdfFile(path), path, std::filesystem::path(path).parent_path().string(), guard);
}

RobotModel RobotModel::FromUrdfText(const std::string& xml, const std::string& source, const std::string& mesh_folder,
                                    const ReadGuard& guard) {
  const CheckedUrdf urdf = CheckUrdf(xml, source);
  RobotModel robot = BuildUrdfTree(urdf, ReadByUrdfdom(urdf), mesh_folder);
  robot.read_guard_ = guard;
  return robot;
}

}  // namespace legopt

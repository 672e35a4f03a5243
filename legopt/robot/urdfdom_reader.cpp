#include "legopt/robot/urdfdom_reader.h"

#include <console_bridge/console.h>
#include <urdf_parser/urdf_parser.h>

#include <limits>
#include <mutex>

#include "legopt/types/input_error.h"
#include "legopt/types/numeric_locale.h"

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

[[noreturn]] void Refuse(const CheckedUrdf& urdf, const std::string& field, const std::string& message) {
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
    link.com = ToEigen(source.inertial->origin).translation();
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
  joint.lower = -std::numeric_limits<double>::infinity();
  joint.upper = std::numeric_limits<double>::infinity();
  if (joint.type == JointType::kContinuous || source.limits == nullptr) return joint;
  joint.lower = source.limits->lower;
  joint.upper = source.limits->upper;
  return joint;
}

urdf::ModelInterfaceSharedPtr Parse(const CheckedUrdf& urdf) {
  const std::lock_guard<std::mutex> lock(UrdfdomMutex());
  LogCapture log;
  urdf::ModelInterfaceSharedPtr model;
  try {
    const ClassicNumericLocale point;
    model = urdf::parseURDF(urdf.text);
  } catch (const std::exception& error) {
    Refuse(urdf, "<robot>", std::string("urdfdom: ") + error.what());
  }
  if (!log.text().empty()) Refuse(urdf, "<robot>", "urdfdom: " + log.text());
  if (model == nullptr) Refuse(urdf, "<robot>", "urdfdom refuses the file");
  return model;
}

}  // namespace

UrdfContent ReadByUrdfdom(const CheckedUrdf& urdf) {
  const urdf::ModelInterfaceSharedPtr model = Parse(urdf);
  UrdfContent content;
  for (const std::string& name : urdf.links) {
    const urdf::LinkConstSharedPtr link = model->getLink(name);
    if (link == nullptr) Refuse(urdf, "link '" + name + "'", "urdfdom did not read it");
    content.links.push_back(MakeLink(*link));
    if (content.links.back().collision.size() != urdf.shapes[content.links.size() - 1]) {
      Refuse(urdf, "link '" + name + "': collision", "urdfdom did not read all of them");
    }
  }
  for (const UrdfJointElement& element : urdf.joints) {
    const urdf::JointConstSharedPtr joint = model->getJoint(element.name);
    if (joint == nullptr) Refuse(urdf, "joint '" + element.name + "'", "urdfdom did not read it");
    content.joints.push_back(MakeJoint(*joint));
  }
  return content;
}

}  // namespace legopt

#include "legopt/robot/urdfdom_reader.h"

#include <console_bridge/console.h>
#include <urdf_parser/urdf_parser.h>

#include <array>
#include <limits>
#include <mutex>
#include <optional>
#include <string_view>
#include <utility>

#include "legopt/types/input_error.h"
#include "legopt/types/isolated_result.h"
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

/// Mutex held while urdfdom runs, including while a child process runs it: urdfdom's log handler and the lock of that
/// handler are global to the process.
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

UrdfContent ReadUnguarded(const CheckedUrdf& urdf) {
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

// The answer of the isolated process: records without names, which the caller already has.

constexpr char kContentFollows = 'U';
constexpr char kFaultFollows = 'F';

struct LinkRecord {
  double mass = 0.0;
  std::array<double, 3> com{};
  std::uint64_t shapes = 0;
};

struct ShapeRecord {
  int kind = 0;
  std::array<double, 3> size{}, scale{};
  std::array<double, 16> pose{};
};

struct JointRecord {
  int type = 0;
  std::array<double, 3> axis{};
  double lower = 0.0, upper = 0.0;
  std::array<double, 16> origin{};
};

std::array<double, 3> Flat(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Eigen::Vector3d Vector(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

std::array<double, 16> Flat(const Eigen::Isometry3d& pose) {
  std::array<double, 16> flat{};
  Eigen::Map<Eigen::Matrix4d>(flat.data()) = pose.matrix();
  return flat;
}

Eigen::Isometry3d Pose(const std::array<double, 16>& flat) {
  return Eigen::Isometry3d(Eigen::Map<const Eigen::Matrix4d>(flat.data()));
}

std::string Encode(const UrdfContent& content) {
  std::vector<LinkRecord> links;
  std::vector<ShapeRecord> shapes;
  std::vector<JointRecord> joints;
  for (const Link& link : content.links) {
    links.push_back({.mass = link.mass, .com = Flat(link.com), .shapes = link.collision.size()});
    for (const ShapeSpec& shape : link.collision) {
      shapes.push_back({static_cast<int>(shape.kind), Flat(shape.size), Flat(shape.scale), Flat(shape.pose)});
    }
  }
  for (const Joint& joint : content.joints) {
    joints.push_back({static_cast<int>(joint.type), Flat(joint.axis), joint.lower, joint.upper, Flat(joint.origin)});
  }
  ResultWriter answer(kContentFollows);
  answer.Add(links);
  answer.Add(shapes);
  answer.Add(joints);
  for (const Link& link : content.links) {
    for (const ShapeSpec& shape : link.collision) answer.Add(shape.mesh_file);
  }
  return answer.Take();
}

std::optional<ShapeSpec> DecodeShape(const ShapeRecord& record, ResultReader* answer) {
  ShapeSpec shape;
  shape.kind = static_cast<ShapeSpec::Kind>(record.kind);
  shape.size = Vector(record.size);
  shape.scale = Vector(record.scale);
  shape.pose = Pose(record.pose);
  const bool known = shape.kind == ShapeSpec::Kind::kBox || shape.kind == ShapeSpec::Kind::kSphere ||
                     shape.kind == ShapeSpec::Kind::kCylinder || shape.kind == ShapeSpec::Kind::kMesh;
  if (!known || !answer->Read(shape.mesh_file)) return std::nullopt;
  return shape;
}

std::optional<Joint> DecodeJoint(const JointRecord& record, const std::string& name) {
  if (record.type < 0 || record.type > static_cast<int>(JointType::kFixed)) return std::nullopt;
  Joint joint;
  joint.name = name;
  joint.type = static_cast<JointType>(record.type);
  joint.axis = Vector(record.axis);
  joint.lower = record.lower;
  joint.upper = record.upper;
  joint.origin = Pose(record.origin);
  return joint;
}

std::optional<UrdfContent> Decode(std::string_view bytes, const CheckedUrdf& urdf) {
  ResultReader answer(bytes);
  std::vector<LinkRecord> links;
  std::vector<ShapeRecord> shapes;
  std::vector<JointRecord> joints;
  if (!answer.Read(links) || !answer.Read(shapes) || !answer.Read(joints)) return std::nullopt;
  if (links.size() != urdf.links.size() || joints.size() != urdf.joints.size()) return std::nullopt;
  UrdfContent content;
  std::size_t next_shape = 0;
  for (std::size_t i = 0; i < links.size(); ++i) {
    Link& link = content.links.emplace_back();
    link.name = urdf.links[i];
    link.mass = links[i].mass;
    link.com = Vector(links[i].com);
    if (links[i].shapes != urdf.shapes[i] || links[i].shapes > shapes.size() - next_shape) return std::nullopt;
    for (std::size_t k = 0; k < urdf.shapes[i]; ++k) {
      std::optional<ShapeSpec> shape = DecodeShape(shapes[next_shape++], &answer);
      if (!shape) return std::nullopt;
      link.collision.push_back(std::move(*shape));
    }
  }
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const std::optional<Joint> joint = DecodeJoint(joints[j], urdf.joints[j].name);
    if (!joint) return std::nullopt;
    content.joints.push_back(*joint);
  }
  return next_shape == shapes.size() && answer.at_end() ? std::optional(content) : std::nullopt;
}

}  // namespace

UrdfContent ReadByUrdfdom(const CheckedUrdf& urdf, const ReadGuard& guard) {
  if (!guard) {
    const std::lock_guard<std::mutex> lock(UrdfdomMutex());
    return ReadUnguarded(urdf);
  }
  const auto read = [&urdf] {
    try {
      return Encode(ReadUnguarded(urdf));
    } catch (const InputError& error) {
      return kFaultFollows + error.fault().field + '\n' + error.fault().message;
    }
  };
  std::string answer;
  try {
    const std::lock_guard<std::mutex> lock(UrdfdomMutex());
    answer = guard(read, {});
  } catch (const GuardedReadError& failure) {
    Refuse(urdf, "", std::string("cannot be read: urdfdom failed: ") + failure.what());
  }
  const std::string_view bytes = answer;
  if (bytes.starts_with(kFaultFollows)) {
    const std::size_t end = answer.find('\n');
    Refuse(urdf, answer.substr(1, end - 1), end == std::string::npos ? "cannot be read" : answer.substr(end + 1));
  }
  if (bytes.starts_with(kContentFollows)) {
    if (std::optional<UrdfContent> content = Decode(bytes.substr(1), urdf)) return std::move(*content);
  }
  Refuse(urdf, "", "cannot be read: urdfdom gave no answer that makes sense");
}

}  // namespace legopt

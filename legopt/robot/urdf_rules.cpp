#include "legopt/robot/urdf_rules.h"

namespace legopt {
namespace {

using Value = UrdfValue;
using Attributes = std::vector<UrdfAttributeRule>;
using Elements = std::vector<UrdfElementRule>;

constexpr bool kRequired = true;

UrdfElementRule Origin() {
  return {.name = "origin",
          .attributes = {{.name = "xyz", .value = Value::kThree},
                         {.name = "rpy", .value = Value::kThree},
                         {.name = "quat_xyzw", .refusal = "write the rotation as rpy=\"roll pitch yaw\", in radians"}}};
}

UrdfElementRule Inertial() {
  Attributes moments;
  for (const char* name : {"ixx", "ixy", "ixz", "iyy", "iyz", "izz"}) {
    moments.push_back({.name = name, .value = Value::kNumber, .required = kRequired});
  }
  return {.name = "inertial",
          .children = {Origin(),
                       {.name = "mass",
                        .least = 1,
                        .attributes = {{.name = "value", .value = Value::kNotNegative, .required = kRequired}}},
                       {.name = "inertia", .least = 1, .attributes = std::move(moments)}}};
}

/// Rule of a shape. Collision shapes need positive sizes; visual shapes may have any size.
UrdfElementRule Geometry(bool touches) {
  const Value length = touches ? Value::kPositive : Value::kNumber;
  const auto shape = [](std::string_view name, Attributes attributes) {
    return UrdfElementRule{.name = name, .attributes = std::move(attributes)};
  };
  const Value size = touches ? Value::kThreePositive : Value::kThree;
  UrdfElementRule capsule = shape("capsule", {});
  capsule.refusal =
      touches ? "capsules are not read: give a <cylinder> and two <sphere>s at its ends, each in a <collision>"
              : "capsules are not read: remove the <visual>, or give a <cylinder>";
  return {.name = "geometry",
          .least = 1,
          .children = {shape("box", {{.name = "size", .value = size, .required = kRequired}}),
                       shape("sphere", {{.name = "radius", .value = length, .required = kRequired}}),
                       shape("cylinder", {{.name = "radius", .value = length, .required = kRequired},
                                          {.name = "length", .value = length, .required = kRequired}}),
                       shape("mesh", {{.name = "filename", .value = Value::kFile, .required = kRequired},
                                      {.name = "scale", .value = touches ? Value::kThreeNotZero : Value::kThree}}),
                       std::move(capsule)},
          .holds_one = true};
}

UrdfElementRule Material() {
  return {
      .name = "material",
      .attributes = {{.name = "name", .value = Value::kName, .required = kRequired}},
      .children = {{.name = "color", .attributes = {{.name = "rgba", .value = Value::kColor, .required = kRequired}}},
                   {.name = "texture",
                    .attributes = {{.name = "filename", .value = Value::kFile, .required = kRequired}}}},
      .read = false};
}

UrdfElementRule LinkRule() {
  return {.name = "link",
          .most = kAnyNumber,
          .attributes = {{.name = "name", .value = Value::kName, .required = kRequired}},
          .children = {Inertial(),
                       {.name = "visual",
                        .most = kAnyNumber,
                        .attributes = {{.name = "name", .read = false}},
                        .children = {Origin(), Geometry(false), Material()},
                        .read = false},
                       {.name = "collision",
                        .most = kAnyNumber,
                        .attributes = {{.name = "name", .read = false}},
                        .children = {Origin(), Geometry(true)}}}};
}

UrdfElementRule LinkName(std::string_view end) {
  return {.name = end, .least = 1, .attributes = {{.name = "link", .value = Value::kName, .required = kRequired}}};
}

UrdfElementRule Limit() {
  return {.name = "limit",
          .attributes = {{.name = "lower", .value = Value::kNumber},
                         {.name = "upper", .value = Value::kNumber},
                         {.name = "effort", .value = Value::kNumber, .required = kRequired},
                         {.name = "velocity", .value = Value::kNumber, .required = kRequired}}};
}

/// Elements of a joint that affect neither its position nor its range.
Elements JointExtras() {
  return {{.name = "dynamics",
           .attributes = {{.name = "damping", .value = Value::kNumber}, {.name = "friction", .value = Value::kNumber}},
           .read = false},
          {.name = "safety_controller",
           .attributes = {{.name = "soft_lower_limit", .value = Value::kNumber},
                          {.name = "soft_upper_limit", .value = Value::kNumber},
                          {.name = "k_position", .value = Value::kNumber},
                          {.name = "k_velocity", .value = Value::kNumber, .required = kRequired}},
           .read = false},
          {.name = "calibration",
           .attributes = {{.name = "rising", .value = Value::kNumber},
                          {.name = "falling", .value = Value::kNumber},
                          {.name = "reference_position", .value = Value::kNumber}},
           .read = false},
          {.name = "mimic", .refusal = "mimic joints are not supported: make the joint fixed or independent"}};
}

UrdfElementRule JointRule() {
  Elements children = {
      Origin(),
      LinkName("parent"),
      LinkName("child"),
      {.name = "axis", .attributes = {{.name = "xyz", .value = Value::kThree, .required = kRequired}}},
      Limit(),
  };
  for (UrdfElementRule& extra : JointExtras()) children.push_back(std::move(extra));
  return {.name = "joint",
          .most = kAnyNumber,
          .attributes = {{.name = "name", .value = Value::kName, .required = kRequired},
                         {.name = "type", .value = Value::kJointType, .required = kRequired}},
          .children = std::move(children)};
}

UrdfElementRule RobotRule() {
  UrdfElementRule material = Material();
  material.most = kAnyNumber;
  return {.name = "robot",
          .least = 1,
          .attributes = {{.name = "name", .value = Value::kName, .required = kRequired},
                         {.name = "version", .value = Value::kVersion, .read = false}},
          .children = {std::move(material), LinkRule(), JointRule()}};
}

}  // namespace

const UrdfElementRule& UrdfRobotRule() {
  static const UrdfElementRule rule = RobotRule();
  return rule;
}

}  // namespace legopt

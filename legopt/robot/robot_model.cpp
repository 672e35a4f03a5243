#include "legopt/robot/robot_model.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "legopt/robot/configuration.h"

namespace legopt {
namespace {

[[noreturn]] void AbortOnBrokenTree(const std::string& robot, size_t joint) {
  std::fprintf(stderr, "legopt: robot '%s': joint %zu breaks the depth-first order\n", robot.c_str(), joint);
  std::abort();
}

}  // namespace

RobotModel::RobotModel(std::string name, std::vector<Link> links, std::vector<Joint> joints)
    : name_(std::move(name)), links_(std::move(links)), joints_(std::move(joints)) {
  for (size_t j = 0; j < joints_.size(); ++j) {
    Joint& joint = joints_[j];
    const bool in_order = joint.child_link == static_cast<int>(j) + 1 && joint.parent_link >= 0 &&
                          joint.parent_link < joint.child_link && joint.child_link < static_cast<int>(links_.size());
    if (!in_order) AbortOnBrokenTree(name_, j);
    links_[static_cast<size_t>(joint.child_link)].parent_joint = static_cast<int>(j);
    joint.dof = -1;
    if (joint.type == JointType::kFixed) continue;
    moving_joints_.push_back(static_cast<int>(j));
    if (joint.leader >= 0) continue;
    joint.dof = static_cast<int>(dof_joints_.size());
    dof_joints_.push_back(static_cast<int>(j));
  }
  for (const int j : moving_joints_) {
    Joint& joint = joints_[static_cast<size_t>(j)];
    if (joint.leader >= 0) joint.dof = joints_[static_cast<size_t>(joint.leader)].dof;
  }
  CollectLimits();
  for (const Link& link : links_) total_mass_ += link.mass;
  BuildBodies();
}

void RobotModel::CollectLimits() {
  lower_.resize(num_dofs());
  upper_.resize(num_dofs());
  effort_.resize(num_dofs());
  velocity_.resize(num_dofs());
  for (int dof = 0; dof < num_dofs(); ++dof) {
    const Joint& joint = joints_[static_cast<size_t>(dof_joint(dof))];
    lower_[dof] = joint.lower;
    upper_[dof] = joint.upper;
    effort_[dof] = joint.effort;
    velocity_[dof] = joint.velocity;
  }
  for (const Joint& joint : joints_) {
    if (joint.leader < 0 || joint.dof < 0 || joint.multiplier == 0.0) continue;
    const double a = (joint.lower - joint.offset) / joint.multiplier;
    const double b = (joint.upper - joint.offset) / joint.multiplier;
    lower_[joint.dof] = std::max(lower_[joint.dof], std::min(a, b));
    upper_[joint.dof] = std::min(upper_[joint.dof], std::max(a, b));
  }
}

void RobotModel::SetEffortLimit(int dof, double limit) {
  joints_[static_cast<size_t>(dof_joint(dof))].effort = effort_[dof] = limit;
}

void RobotModel::SetVelocityLimit(int dof, double limit) {
  joints_[static_cast<size_t>(dof_joint(dof))].velocity = velocity_[dof] = limit;
}

void RobotModel::BuildBodies() {
  link_body_.assign(links_.size(), 0);
  link_in_body_.assign(links_.size(), Eigen::Isometry3d::Identity());
  body_parent_.assign(static_cast<size_t>(num_bodies()), -1);
  body_chain_.assign(static_cast<size_t>(num_bodies()), {});
  size_t body = 0;
  for (const Joint& joint : joints_) {
    const auto child = static_cast<size_t>(joint.child_link);
    const auto parent = static_cast<size_t>(joint.parent_link);
    if (joint.type == JointType::kFixed) {
      link_body_[child] = link_body_[parent];
      link_in_body_[child] = link_in_body_[parent] * joint.origin;
      continue;
    }
    ++body;
    link_body_[child] = static_cast<int>(body);
    body_parent_[body] = link_body_[parent];
    body_chain_[body] = body_chain_[static_cast<size_t>(link_body_[parent])];
    body_chain_[body].push_back(static_cast<int>(body));
  }
}

void RobotModel::ClampJoints(Eigen::Ref<Eigen::VectorXd> x) const {
  auto joints = x.head(num_dofs());
  joints = joints.cwiseMax(lower_).cwiseMin(upper_);
}

Eigen::VectorXd RobotModel::NeutralConfiguration() const {
  Eigen::VectorXd x = ConfigurationAt(num_dofs(), Eigen::Isometry3d::Identity());
  ClampJoints(x);
  return x;
}

int RobotModel::FindLink(std::string_view name) const {
  for (size_t i = 0; i < links_.size(); ++i) {
    if (links_[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

int RobotModel::FindJoint(std::string_view name) const {
  for (size_t i = 0; i < joints_.size(); ++i) {
    if (joints_[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

int RobotModel::MovingJointsBetween(int link_a, int link_b) const {
  const std::vector<int>& a = body_chain(link_body(link_a));
  const std::vector<int>& b = body_chain(link_body(link_b));
  size_t common = 0;
  while (common < a.size() && common < b.size() && a[common] == b[common]) ++common;
  return static_cast<int>(a.size() + b.size() - 2 * common);
}

std::vector<std::string> DofNames(const RobotModel& robot) {
  std::vector<std::string> names;
  for (int dof = 0; dof < robot.num_dofs(); ++dof) {
    names.push_back(robot.joints()[static_cast<size_t>(robot.dof_joint(dof))].name);
  }
  return names;
}

std::string_view ToString(JointType type) {
  switch (type) {
    case JointType::kRevolute:
      return "revolute";
    case JointType::kContinuous:
      return "continuous";
    case JointType::kPrismatic:
      return "prismatic";
    case JointType::kFixed:
      break;
  }
  return "fixed";
}

std::string_view UnitOf(JointType type) { return type == JointType::kPrismatic ? "m" : "rad"; }

}  // namespace legopt

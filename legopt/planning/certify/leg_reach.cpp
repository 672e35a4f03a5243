#include "legopt/planning/certify/leg_reach.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <queue>

namespace legopt::certify {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

const std::array<Vector3d, ReachFeatures::kDirections>& Directions() {
  static const std::array<Vector3d, ReachFeatures::kDirections> kAll = [] {
    std::array<Vector3d, ReachFeatures::kDirections> all = {
        Vector3d(1, 0, 0),  Vector3d(0, 1, 0),  Vector3d(0, 0, 1), Vector3d(1, 1, 0),  Vector3d(1, -1, 0),
        Vector3d(1, 0, 1),  Vector3d(1, 0, -1), Vector3d(0, 1, 1), Vector3d(0, 1, -1), Vector3d(1, 1, 1),
        Vector3d(1, 1, -1), Vector3d(1, -1, 1), Vector3d(-1, 1, 1)};
    for (Vector3d& direction : all) direction.normalize();
    return all;
  }();
  return kAll;
}

bool IsTurn(int feature) { return feature >= ReachFeatures::kFirstOfTurn; }
bool IsOfHip(int feature) { return feature >= ReachFeatures::kFirstOfHip && feature < ReachFeatures::kFirstOfAnkle; }

}  // namespace

/// A box of joint values. The one with the largest bound is processed first.
struct LegReach::Box {
  Joints centre{}, half{};
  double bound = 0.0;

  bool operator<(const Box& other) const { return bound < other.bound; }
};

LegReach::LegReach(const RobotModel& robot, int link) : last_(Isometry3d::Identity()) {
  ReadChain(robot, link);
  bounded_ = bounded_ && !joints_.empty() && std::ssize(joints_) <= kMaxJoints;
  if (!bounded_) return;
  hip_B_ = joints_.front().origin.translation();
  ankle_F_ = last_.inverse().translation();
  for (int feature = 0; feature < ReachFeatures::kCount; ++feature) {
    const auto index = static_cast<std::size_t>(feature);
    highest_[index] = UpperBound(feature, 1.0);
    lowest_[index] = -UpperBound(feature, -1.0);
  }
}

void LegReach::ReadChain(const RobotModel& robot, int link) {
  Isometry3d behind = Isometry3d::Identity();  // pose of the link in the current frame
  for (int at = link; robot.links()[static_cast<std::size_t>(at)].parent_joint >= 0;) {
    const Joint& joint =
        robot.joints()[static_cast<std::size_t>(robot.links()[static_cast<std::size_t>(at)].parent_joint)];
    at = joint.parent_link;
    if (joint.type != JointType::kFixed) {
      if (joints_.empty()) {
        last_ = behind;
      } else {
        joints_.back().origin = behind * joints_.back().origin;
      }
      behind = Isometry3d::Identity();
      ChainJoint& entry = joints_.emplace_back();
      entry.origin = joint.origin;
      entry.axis = joint.axis;
      entry.slides = joint.type == JointType::kPrismatic;
      entry.lower = joint.lower;
      entry.upper = joint.upper;
      if (!entry.slides && !(joint.upper - joint.lower < 2.0 * M_PI)) {  // a full circle
        entry.lower = -M_PI;
        entry.upper = M_PI;
      }
      bounded_ = bounded_ && std::isfinite(entry.lower) && std::isfinite(entry.upper);
    } else {
      behind = joint.origin * behind;
    }
  }
  if (!joints_.empty()) joints_.back().origin = behind * joints_.back().origin;
  std::reverse(joints_.begin(), joints_.end());
}

Isometry3d LegReach::Pose(const Joints& q) const {
  Isometry3d pose = Isometry3d::Identity();
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    pose = pose * joints_[j].origin;
    if (joints_[j].slides) {
      pose.translate(q[j] * joints_[j].axis);
    } else {
      pose.rotate(Eigen::AngleAxisd(q[j], joints_[j].axis));
    }
  }
  return pose * last_;
}

ReachFeatures::Values LegReach::Features(const Isometry3d& X_BF) const {
  const Vector3d hip_F = X_BF.inverse(Eigen::Isometry) * hip_B_ - ankle_F_;
  const Vector3d ankle_B = X_BF * ankle_F_ - hip_B_;
  ReachFeatures::Values values{};
  values[0] = ankle_B.norm();
  for (int k = 0; k < ReachFeatures::kDirections; ++k) {
    const Vector3d& direction = Directions()[static_cast<std::size_t>(k)];
    values[static_cast<std::size_t>(ReachFeatures::kFirstOfHip + k)] = direction.dot(hip_F);
    values[static_cast<std::size_t>(ReachFeatures::kFirstOfAnkle + k)] = direction.dot(ankle_B);
  }
  const Eigen::Matrix3d turn = X_BF.linear();
  std::copy_n(turn.data(), turn.size(), values.begin() + ReachFeatures::kFirstOfTurn);
  return values;
}

/// Returns the largest change of a feature per unit of each joint. Rotation about a joint moves hip and ankle, relative
/// to each other, by at most their distances from it. It changes the distance between them by at most the smaller one.
LegReach::Joints LegReach::Levers(int feature) const {
  const auto length = [this](std::size_t j) {  // distance from the previous joint
    const double slide = joints_[j].slides ? std::max(std::abs(joints_[j].lower), std::abs(joints_[j].upper)) : 0.0;
    return (j > 0 ? joints_[j].origin.translation().norm() : 0.0) + slide;
  };
  double to_ankle = 0.0;
  for (std::size_t j = 0; j < joints_.size(); ++j) to_ankle += length(j);
  double to_hip = 0.0;
  Joints levers{};
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    to_hip += length(j);
    to_ankle -= length(j);
    if (joints_[j].slides) {
      levers[j] = IsTurn(feature) ? 0.0 : 1.0;
    } else if (IsTurn(feature)) {
      levers[j] = 1.0;
    } else {
      levers[j] = feature == 0 ? std::min(to_hip, to_ankle) : (IsOfHip(feature) ? to_hip : to_ankle);
    }
  }
  return levers;
}

double LegReach::UpperBound(int feature, double sign) const {
  constexpr int kMaxBoxes = 20000;
  constexpr double kClose = 1e-3;
  constexpr double kRounding = 1e-9;
  const Joints levers = Levers(feature);
  double best = -kInfinity;  // largest value reached so far
  const auto bound = [&](Box& box) {
    const double value = sign * Features(Pose(box.centre))[static_cast<std::size_t>(feature)];
    best = std::max(best, value);
    box.bound = value + kRounding;
    for (std::size_t j = 0; j < joints_.size(); ++j) box.bound += levers[j] * box.half[j];
  };
  std::priority_queue<Box> boxes;
  Box all;
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    all.centre[j] = 0.5 * (joints_[j].lower + joints_[j].upper);
    all.half[j] = 0.5 * (joints_[j].upper - joints_[j].lower);
  }
  bound(all);
  boxes.push(all);
  for (int count = 0; count < kMaxBoxes && boxes.top().bound > best + kClose; ++count) {
    const Box parent = boxes.top();
    boxes.pop();
    std::size_t widest = 0;
    for (std::size_t j = 1; j < joints_.size(); ++j) {
      if (levers[j] * parent.half[j] > levers[widest] * parent.half[widest]) widest = j;
    }
    for (const double side : {-1.0, 1.0}) {
      Box child = parent;
      child.half[widest] *= 0.5;
      child.centre[widest] += side * child.half[widest];
      bound(child);
      child.bound = std::min(child.bound, parent.bound);
      boxes.push(child);
    }
  }
  return boxes.top().bound;
}

}  // namespace legopt::certify

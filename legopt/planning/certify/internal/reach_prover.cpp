#include "legopt/planning/certify/internal/reach_prover.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <queue>

#include "legopt/judge/judge.h"

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

namespace {

// The judge's tolerances of a foot pose: three components each of a quaternion and of a translation.
constexpr double kFootShift_m = 1.8 * kPoseTolerance;
constexpr double kFootTurn_rad = 3.6 * kPoseTolerance;

/// Bounds of the motion of the base.
struct Slack {
  double shift_m = 0.0;   ///< displacement of the base's origin
  double turn_rad = 0.0;  ///< rotation of the base
};

}  // namespace

/// A planted foot.
struct ReachProver::Standing {
  const LegReach* leg;
  Isometry3d X_WF;  ///< target of the foot

  /// Returns how far the worst feature is out of bounds, beyond the effect of the slack; <= 0: no feature is.
  double Excess(const Isometry3d& X_WB, const Slack& slack) const;
};

double ReachProver::Standing::Excess(const Isometry3d& X_WB, const Slack& slack) const {
  const ReachFeatures::Values values = leg->Features(X_WB.inverse(Eigen::Isometry) * X_WF);
  const double foot = kFootShift_m + kFootTurn_rad * leg->ankle_F().norm();
  const double of_hip = slack.shift_m + slack.turn_rad * leg->hip_B().norm();
  const double base_to_ankle = (X_WF * leg->ankle_F() - X_WB.translation()).norm();
  const double of_distance = foot + of_hip;
  const double of_hip_in_foot = foot + of_hip + kFootTurn_rad * (values[0] + of_distance);
  const double of_ankle = foot + slack.shift_m + slack.turn_rad * base_to_ankle;
  const double of_turn = kFootTurn_rad + slack.turn_rad;
  double excess = -std::numeric_limits<double>::infinity();
  for (int feature = 0; feature < ReachFeatures::kCount; ++feature) {
    const auto i = static_cast<std::size_t>(feature);
    double allowance = of_distance;
    if (feature >= ReachFeatures::kFirstOfTurn) {
      allowance = of_turn;
    } else if (feature >= ReachFeatures::kFirstOfAnkle) {
      allowance = of_ankle;
    } else if (feature >= ReachFeatures::kFirstOfHip) {
      allowance = of_hip_in_foot;
    }
    excess = std::max({excess, values[i] - leg->highest()[i] - allowance, leg->lowest()[i] - values[i] - allowance});
  }
  return excess;
}

/// Cell of base poses: position, yaw, pitch, roll.
struct ReachProver::Cell {
  std::array<double, 6> centre{}, half{};
  double excess = 0.0;  ///< excess of the centre; smallest first, as a centre at <= 0 ends the proof

  bool operator<(const Cell& other) const { return excess > other.excess; }

  Isometry3d Pose() const {
    Isometry3d pose = Isometry3d::Identity();
    pose.translation() = Vector3d(centre[0], centre[1], centre[2]);
    pose.linear() = (Eigen::AngleAxisd(centre[3], Vector3d::UnitZ()) * Eigen::AngleAxisd(centre[4], Vector3d::UnitY()) *
                     Eigen::AngleAxisd(centre[5], Vector3d::UnitX()))
                        .toRotationMatrix();
    return pose;
  }
  /// Returns the extent of the cell; rotations by the three angles add up at most.
  Slack Extent() const { return {Vector3d(half[0], half[1], half[2]).norm(), half[3] + half[4] + half[5]}; }

  std::size_t Widest(double lever_m) const {
    std::size_t widest = 0;
    const auto width = [&](std::size_t i) { return half.at(i) * (i < 3 ? 1.0 : lever_m); };
    for (std::size_t i = 1; i < half.size(); ++i) {
      if (width(i) > width(widest)) widest = i;
    }
    return widest;
  }
};

ReachProver::ReachProver(const Dataset& dataset) : dataset_(&dataset) {
  for (const Contact& contact : dataset.contacts()) {
    if (contact.facts().free_rotation != FreeRotation::kNone) continue;  // its link may turn: its pose is not known
    legs_.emplace(contact.link, LegReach(dataset.robot(), contact.link_index));
  }
}

std::vector<ReachProver::Standing> ReachProver::StanceLegs(const Stance& stance) const {
  std::vector<Standing> standing;
  for (const ContactTarget& target : stance.contacts) {
    const Contact& contact = dataset_->contact(target.contact);
    if (contact.facts().free_rotation != FreeRotation::kNone) continue;
    const LegReach& leg = legs_.at(contact.link);
    if (leg.bounded()) standing.push_back({&leg, dataset_->LinkTarget(target)});
  }
  return standing;
}

bool ReachProver::Allows(const Stance& stance, const Isometry3d& X_WB) const {
  const std::vector<Standing> standing = StanceLegs(stance);
  return std::all_of(standing.begin(), standing.end(),
                     [&](const Standing& foot) { return foot.Excess(X_WB, {}) <= 0.0; });
}

std::optional<std::string> ReachProver::Refute(const Stance& stance, int most_cells) const {
  const std::vector<Standing> standing = StanceLegs(stance);
  if (standing.empty()) return std::nullopt;
  const auto largest_excess = [&](const Isometry3d& X_WB, const Slack& slack) {
    double excess = standing.front().Excess(X_WB, slack);
    for (std::size_t i = 1; i < standing.size(); ++i) excess = std::max(excess, standing[i].Excess(X_WB, slack));
    return excess;
  };
  const LegReach& first = *standing.front().leg;
  const double reach_m =
      first.highest()[0] + first.hip_B().norm() + kFootShift_m + kFootTurn_rad * first.ankle_F().norm();
  const Vector3d ankle_W = standing.front().X_WF * first.ankle_F();
  Cell all;
  all.centre = {ankle_W.x(), ankle_W.y(), ankle_W.z(), 0.0, 0.0, 0.0};
  all.half = {reach_m, reach_m, reach_m, M_PI, M_PI_2, M_PI};
  std::priority_queue<Cell> cells;
  cells.push(all);
  int count = 1;
  while (!cells.empty()) {
    const Cell parent = cells.top();
    cells.pop();
    const std::size_t widest = parent.Widest(reach_m);
    for (const double side : {-1.0, 1.0}) {
      Cell child = parent;
      child.half.at(widest) *= 0.5;
      child.centre.at(widest) += side * child.half.at(widest);
      const Isometry3d pose = child.Pose();
      if (++count > most_cells) return std::nullopt;
      if (largest_excess(pose, child.Extent()) > 0.0) continue;
      child.excess = largest_excess(pose, {});
      if (child.excess <= 0.0) return std::nullopt;
      cells.push(child);
    }
  }
  std::string feet;
  for (const ContactTarget& target : stance.contacts) feet += (feet.empty() ? "" : " and ") + target.contact;
  return "no pose of the base has " + feet + " within reach of the legs (" + std::to_string(count) + " cells)";
}

}  // namespace legopt::certify

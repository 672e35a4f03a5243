#include "legopt/planning/certify/reach_prover.h"

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
  for (const Contact& foot : dataset.contacts()) {
    legs_.emplace(foot.link, LegReach(dataset.robot(), foot.link_index));
  }
}

std::vector<ReachProver::Standing> ReachProver::StanceLegs(const Stance& stance) const {
  std::vector<Standing> standing;
  for (const ContactTarget& target : stance.contacts) {
    const LegReach& leg = legs_.at(dataset_->contact(target.contact).link);
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

#pragma once

#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "legopt/robot/robot_model.h"

namespace legopt::certify {

/// Numbers that the pose of a foot in the base decides: the distance of the ankle from the hip (m), the hip as the foot
/// sees it and the ankle as the base sees it along 13 directions (m), the entries of the rotation (1). Hip and ankle
/// are the places of the leg's first and last joint, the one fixed in the base, the other in the foot.
struct ReachFeatures {
  static constexpr int kDirections = 13;                            ///< axes, face diagonals and corners of a cube
  static constexpr int kFirstOfHip = 1;                             ///< behind the distance
  static constexpr int kFirstOfAnkle = kFirstOfHip + kDirections;   ///< then those of the ankle
  static constexpr int kFirstOfTurn = kFirstOfAnkle + kDirections;  ///< then the entries of the rotation, by column
  static constexpr int kCount = kFirstOfTurn + 9;                   ///< of all
  using Values = std::array<double, kCount>;                        ///< one for each
};

/// What a leg can reach: bounds of ReachFeatures over all values of its joints, whatever else the robot does.
///
/// The bounds are sound and not tight: the largest value over a box of joints is at most that at its centre plus, for
/// each joint, half its range times the longest lever that it can have; the box with the largest such bound is halved,
/// a limited number of times. Immutable; any thread.
class LegReach {
 public:
  /// Of the chain from the base to `link`. Takes tenths of a second.
  LegReach(const RobotModel& robot, int link);

  /// Whether there are bounds: a chain with 1 to 12 joints, sliding ones with limits.
  bool bounded() const { return bounded_; }
  const ReachFeatures::Values& lowest() const { return lowest_; }    ///< nothing reachable is below
  const ReachFeatures::Values& highest() const { return highest_; }  ///< or above
  const Eigen::Vector3d& hip_B() const { return hip_B_; }            ///< place of the first joint, in the base, m
  const Eigen::Vector3d& ankle_F() const { return ankle_F_; }        ///< place of the last joint, in the link, m

  /// The features of a pose of the link in the base.
  ReachFeatures::Values Features(const Eigen::Isometry3d& X_BF) const;

 private:
  static constexpr int kMostJoints = 12;
  using Joints = std::array<double, kMostJoints>;
  struct ChainJoint {
    Eigen::Isometry3d origin;  ///< joint frame in the frame of the link that the joint before moves
    Eigen::Vector3d axis;      ///< unit, in the joint frame
    bool slides = false;
    double lower = 0.0, upper = 0.0;  ///< rad or m
  };
  struct Box;

  void ReadChain(const RobotModel& robot, int link);
  Eigen::Isometry3d Pose(const Joints& q) const;
  Joints Levers(int feature) const;
  double UpperBound(int feature, double sign) const;

  bool bounded_ = true;
  std::vector<ChainJoint> joints_;  ///< from the base outwards
  Eigen::Isometry3d last_;          ///< the link in the frame that the last joint moves
  Eigen::Vector3d hip_B_ = Eigen::Vector3d::Zero(), ankle_F_ = Eigen::Vector3d::Zero();
  ReachFeatures::Values lowest_{}, highest_{};
};

}  // namespace legopt::certify

#pragma once

#include <Eigen/Geometry>
#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/dataset/problem_definition.h"
#include "legopt/robot/robot_model.h"

namespace legopt::certify {

/// Numbers that the pose of a foot in the base determines: the distance of the ankle from the hip (m), the vectors from
/// ankle to hip in the foot's frame and from hip to ankle in the base's frame along 13 directions (m), and the
/// entries of the rotation (1). Hip and ankle are the positions of the leg's first and last joint. The hip is fixed in
/// the base, the ankle in the foot.
struct ReachFeatures {
  static constexpr int kDirections = 13;                            ///< axes, face diagonals and corners of a cube
  static constexpr int kFirstOfHip = 1;                             ///< after the distance
  static constexpr int kFirstOfAnkle = kFirstOfHip + kDirections;   ///< start of the ankle's components
  static constexpr int kFirstOfTurn = kFirstOfAnkle + kDirections;  ///< start of the rotation's entries, by column
  static constexpr int kCount = kFirstOfTurn + 9;                   ///< number of all features
  using Values = std::array<double, kCount>;                        ///< one value per feature
};

/// Reach of a leg: bounds of ReachFeatures over all values of its joints, independent of the rest of the robot.
///
/// The bounds are sound but not tight. The largest value over a box of joint values is at most the one at its centre
/// plus, for each joint, half its range times its longest possible lever. The box with the largest bound is bisected, a
/// limited number of times. Immutable; any thread.
class LegReach {
 public:
  /// Computes the bounds for the chain from the base to `link`. Takes tenths of a second.
  LegReach(const RobotModel& robot, int link);

  /// Returns whether there are bounds: a chain of 1 to 12 joints, in which prismatic joints have limits.
  bool bounded() const { return bounded_; }
  const ReachFeatures::Values& lowest() const { return lowest_; }    ///< lower bounds of reachable values
  const ReachFeatures::Values& highest() const { return highest_; }  ///< upper bounds of reachable values
  const Eigen::Vector3d& hip_B() const { return hip_B_; }            ///< position of the first joint in the base, m
  const Eigen::Vector3d& ankle_F() const { return ankle_F_; }        ///< position of the last joint in the link, m

  /// Returns the features of a pose of the link in the base.
  ReachFeatures::Values Features(const Eigen::Isometry3d& X_BF) const;

 private:
  static constexpr int kMaxJoints = 12;
  using Joints = std::array<double, kMaxJoints>;
  struct ChainJoint {
    Eigen::Isometry3d origin;  ///< joint frame in the frame of the link that the previous joint moves
    Eigen::Vector3d axis;      ///< unit vector in the joint frame
    bool slides = false;
    double lower = 0.0, upper = 0.0;  ///< rad or m
  };
  struct Box;

  void ReadChain(const RobotModel& robot, int link);
  Eigen::Isometry3d Pose(const Joints& q) const;
  Joints Levers(int feature) const;
  double UpperBound(int feature, double sign) const;

  bool bounded_ = true;
  std::vector<ChainJoint> joints_;  ///< ordered from the base outwards
  Eigen::Isometry3d last_;          ///< pose of the link in the frame that the last joint moves
  Eigen::Vector3d hip_B_ = Eigen::Vector3d::Zero(), ankle_F_ = Eigen::Vector3d::Zero();
  ReachFeatures::Values lowest_{}, highest_{};
};

/// Proves that a stance has no posture because of the legs alone: no pose of the base has all planted feet within their
/// legs' reach (LegReach), including the judge's tolerances of their poses. Trunk, arms, balance and scene are not
/// considered.
///
/// Branch and bound over position, yaw, pitch and roll of the base. A cell is discarded if one feature of one leg is
/// out of bounds at its centre by more than it can change within the cell. If all cells are discarded, that is a proof.
/// If a centre is within all bounds, the search ends without a proof.
///
/// Sound, but incomplete. Immutable; any thread; the dataset must outlive it.
class ReachProver {
 public:
  /// Maximum number of cells.
  static constexpr int kMaxCells = 200'000;

  /// Computes the reach of the legs: about a second.
  explicit ReachProver(const Dataset& dataset);

  /// Returns the proof as a sentence, or nothing if there is none. Throws InputError for a link that is not a foot.
  std::optional<std::string> Refute(const Stance& stance, int most_cells = kMaxCells) const;
  /// Returns whether this pose of the base is within the bounds of all legs, as it is for every posture of the stance.
  bool Allows(const Stance& stance, const Eigen::Isometry3d& X_WB) const;

 private:
  struct Standing;
  struct Cell;

  std::vector<Standing> StanceLegs(const Stance& stance) const;

  const Dataset* dataset_;
  std::map<std::string, LegReach> legs_;  ///< one entry per foot
};

}  // namespace legopt::certify

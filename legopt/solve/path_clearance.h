#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <deque>
#include <vector>

#include "legopt/collision/collision_query.h"
#include "legopt/robot/kinematics.h"
#include "legopt/robot/robot_model.h"

namespace legopt {

/// Whether the robot collides on the way between two configurations, as far as the solver's own shapes tell.
///
/// Between two samples a link that moves by no more than `way` cannot come nearer to the scene than half of (its
/// distances at both, less `way`); likewise two links, by the way of one in the frame of the other. Intervals for which
/// that does not exclude a distance below kClearance_m are bisected, so that samples are dense only where things are
/// near. Ways are measured as straight lines of the links' balls, which is good to a few per mille at kLargestTurn.
///
/// A workspace; one thread.
class PathClearance {
 public:
  /// Distance to keep, m: where surfaces only just touch at an edge, the judge's contact depth, which is measured
  /// against face normals, may be centimetres.
  static constexpr double kClearance_m = 5e-5;
  /// Largest turn of a joint or the base between samples, rad (m for prismatic joints).
  static constexpr double kLargestTurn = 0.2;

  /// Both must outlive it; `query` is of the robot's collision model. `range_m` > 0: distances above it are not
  /// looked at, which changes the number of samples only.
  PathClearance(const RobotModel& robot, CollisionQuery& query, double range_m);

  /// Of the piece from one configuration to the other (n + 7 each), both ends included, on the path of
  /// robot/interpolation.h.
  bool IsFree(Eigen::Ref<const Eigen::VectorXd> from, Eigen::Ref<const Eigen::VectorXd> to);
  /// The deepest contact of the sample that was not free, when it last was not.
  const Contact& obstacle() const { return obstacle_; }

 private:
  /// One configuration: distances by link to the scene and by checked pair, at most the range, m.
  struct Sample {
    explicit Sample(const RobotModel& robot) : kinematics(robot) {}
    Kinematics kinematics;
    std::vector<double> scene_m;
    std::vector<double> pairs_m;
    Contact nearest;
  };
  Sample& Level(std::size_t level);
  void Place(double s, Sample* sample);
  bool IsFreeAt(const Sample& sample);
  bool Excluded(const Sample& a, const Sample& b) const;
  bool Bisect(std::size_t level, double s_a, const Sample& a, double s_b, const Sample& b);

  const RobotModel* robot_;
  CollisionQuery* query_;
  ContactMemory memory_;  ///< samples lie close together
  double range_m_;
  std::vector<int> pair_index_;  ///< of the checked pairs by (first, second); -1: not checked
  std::deque<Sample> levels_;
  Eigen::VectorXd from_, to_, x_;
  double turn_ = 0.0;
  Contact obstacle_;
};

}  // namespace legopt

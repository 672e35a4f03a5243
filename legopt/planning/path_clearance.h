#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <deque>
#include <vector>

#include "legopt/geometry/collision_query.h"
#include "legopt/robot/kinematics.h"
#include "legopt/robot/robot_model.h"

namespace legopt {

/// Checks whether the robot collides on the path between two configurations, according to the solver's own shapes.
///
/// Between two samples, a link that moves by at most `way` comes no nearer to the scene than half of (the sum of its
/// distances at both samples, minus `way`). The same holds for two links, with the displacement of one in the frame of
/// the other. If this does not exclude a distance below kClearance_m, the interval is bisected, so that samples are
/// dense only near obstacles. Displacements are measured as straight lines of the links' bounding balls, which is
/// accurate to a few per mille at kLargestTurn.
///
/// A workspace; one thread.
class PathClearance {
 public:
  /// Distance to keep, m. If surfaces only just touch at an edge, the judge's contact depth, which is measured along
  /// face normals, may be centimetres.
  static constexpr double kClearance_m = 5e-5;
  /// Largest rotation of a joint or the base between samples, rad (m for prismatic joints).
  static constexpr double kLargestTurn = 0.2;

  /// Both must outlive this object; `query` uses the robot's collision model. Distances above `range_m` > 0 are not
  /// computed, which only changes the number of samples.
  PathClearance(const RobotModel& robot, CollisionQuery& query, double range_m);

  /// Returns whether the path of robot/interpolation.h between two configurations (n + 7 each) is free, including both
  /// ends.
  bool IsFree(Eigen::Ref<const Eigen::VectorXd> from, Eigen::Ref<const Eigen::VectorXd> to);
  /// Deepest contact of the last sample that was not free.
  const ProximityPair& obstacle() const { return obstacle_; }

 private:
  /// One configuration: distances of each link to the scene and of each checked pair, at most the range, m.
  struct Sample {
    explicit Sample(const RobotModel& robot) : kinematics(robot) {}
    Kinematics kinematics;
    std::vector<double> scene_m;
    std::vector<double> pairs_m;
    ProximityPair nearest;
  };
  Sample& Level(std::size_t level);
  void Place(double s, Sample* sample);
  bool IsFreeAt(const Sample& sample);
  bool Excluded(const Sample& a, const Sample& b) const;
  bool Bisect(std::size_t level, double s_a, const Sample& a, double s_b, const Sample& b);

  const RobotModel* robot_;
  CollisionQuery* query_;
  WarmStartCache memory_;  ///< speeds up queries at nearby samples
  double range_m_;
  std::vector<int> pair_index_;  ///< index of each checked pair (first, second); -1: not checked
  std::deque<Sample> levels_;
  Eigen::VectorXd from_, to_, x_;
  double turn_ = 0.0;
  ProximityPair obstacle_;
};

}  // namespace legopt

#pragma once

#include <deque>
#include <memory>
#include <vector>

#include "legopt/problem/dataset.h"
#include "legopt/problem/program.h"
#include "legopt/problem/waypoint_state.h"

namespace legopt {

/// How collision enters a program. Metres.
struct ContactOptions {
  double margin_m = 5e-4;  ///< distance to keep
  double range_m = 0.03;   ///< pairs nearer than this become rows; > margin_m
};

/// A chain of waypoints of one robot, each bound to a stance: one pose term per foot, the centre of mass over the
/// support polygon of the targets, collision, joint limits as bounds. Costs are added by the task.
///
/// A workspace: the dataset and the collision query, which must be one of the dataset's collision model, must outlive
/// it. One thread.
class WaypointProgram : public Program {
 public:
  /// The posture task: one waypoint with the torque cost; five terms in double support.
  static std::unique_ptr<WaypointProgram> Posture(const Dataset& dataset, CollisionQuery& query, const Stance& stance,
                                                  const ContactOptions& contacts);

  int num_waypoints() const override { return static_cast<int>(states_.size()); }
  int tangent_size() const override { return robot_->tangent_size(); }
  int point_size() const override { return robot_->configuration_size(); }
  const std::vector<std::unique_ptr<Term>>& terms() const override { return terms_; }
  void SetPoint(Eigen::Ref<const Eigen::VectorXd> x) override;
  void Retract(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<const Eigen::VectorXd> dx,
               Eigen::Ref<Eigen::VectorXd> x_next) const override;
  void StepBounds(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<Eigen::VectorXd> lower,
                  Eigen::Ref<Eigen::VectorXd> upper) const override;
  void ProjectOnBounds(Eigen::Ref<Eigen::VectorXd> x) const override;

  WaypointState& state(int waypoint) { return states_[static_cast<size_t>(waypoint)]; }

 private:
  WaypointProgram(const Dataset& dataset, CollisionQuery& query, const std::vector<const Stance*>& stances,
                  const ContactOptions& contacts);
  void AddConstraints(const Dataset& dataset, const Stance& stance, int waypoint, double margin_m);

  const RobotModel* robot_;
  std::deque<WaypointState> states_;  ///< terms point into it
  std::vector<std::unique_ptr<Term>> terms_;
};

}  // namespace legopt

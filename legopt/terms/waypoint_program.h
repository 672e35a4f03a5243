#pragma once

#include <deque>
#include <memory>
#include <span>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/program/program.h"
#include "legopt/terms/waypoint_state.h"
#include "words/collision.h"

namespace legopt {

/// How collision enters a program. Metres.
struct ContactOptions {
  double margin_m = 5e-4;                                            ///< distance to keep
  double range_m = 0.03;                                             ///< pairs nearer than this become rows; > margin_m
  ContinuousCollision continuous = ContinuousCollision::kPreferred;  ///< windows
  double continuous_weight = 1e2;                                    ///< of the preference, per metre, > 0
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

  /// A window of the motion task: two waypoints per stance, the velocity cost as one sampling unit
  /// (docs/readings.md#terms-and-samples), continuous collision between consecutive waypoints as asked for.
  /// With `fixed_first` the first waypoint does not move (docs/readings.md#motion-windows).
  static std::unique_ptr<WaypointProgram> Window(const Dataset& dataset, CollisionQuery& query,
                                                 std::span<const Stance> stances, const ContactOptions& contacts,
                                                 bool fixed_first);

  int num_waypoints() const override { return static_cast<int>(states_.size()); }
  int tangent_size() const override { return robot_->tangent_size(); }
  int point_size() const override { return robot_->configuration_size(); }
  const std::vector<std::unique_ptr<Term>>& terms() const override { return terms_; }
  void SetPoint(Eigen::Ref<const Eigen::VectorXd> x) override;
  void Retract(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<const Eigen::VectorXd> dx,
               Eigen::Ref<Eigen::VectorXd> x_next) const override;
  /// Joints and position are plain sums. A turn by phi of the base, exp(phi) R, moves by phi + d as the local tangent
  /// J(phi) d, with J the left Jacobian of SO(3).
  void PullBack(const double* dx, double* row) const override;
  void StepBounds(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<Eigen::VectorXd> lower,
                  Eigen::Ref<Eigen::VectorXd> upper) const override;
  void ProjectOnBounds(Eigen::Ref<Eigen::VectorXd> x) const override;

  WaypointState& state(int waypoint) { return states_[static_cast<size_t>(waypoint)]; }

 private:
  WaypointProgram(const Dataset& dataset, CollisionQuery& query, const std::vector<const Stance*>& stances,
                  const ContactOptions& contacts);
  void AddConstraints(const Dataset& dataset, const Stance& stance, int waypoint, double margin_m);

  /// First waypoint that moves.
  Eigen::Index first_free() const { return fixed_first_ ? 1 : 0; }

  const RobotModel* robot_;
  bool fixed_first_ = false;
  std::deque<WaypointState> states_;  ///< terms point into it
  std::vector<std::unique_ptr<Term>> terms_;
};

}  // namespace legopt

#pragma once

#include <deque>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/program/program.h"
#include "legopt/terms/waypoint_state.h"
#include "words/collision.h"

namespace legopt {

/// How collision enters a program. Metres.
struct ContactOptions {
  double margin_m = 5e-4;         ///< distance to keep
  double spent_margin_m = -5e-4;  ///< in its place where nothing else helps: half of the depth that the judge tolerates
  double range_m = 0.03;          ///< pairs nearer than this become rows; > margin_m
  ContinuousCollision continuous = ContinuousCollision::kPreferred;  ///< of programs with transitions
  double continuous_weight = 1e2;                                    ///< of the preference, per metre, > 0
};

/// What one waypoint of a chain has to meet beside its joint limits.
struct WaypointDemand {
  const Stance* stance = nullptr;  ///< its feet are planted, nothing collides; null: no terms
  bool fixed = false;              ///< it does not move
  bool balanced = true;            ///< the centre of mass is over the support polygon of its feet
  bool on_a_way = false;           ///< its feet drift on the way to the next one, and keep their reserve for that
};

/// A chain of waypoints of one robot, each bound to a stance: one pose term per foot, the centre of mass over the
/// support polygon of the targets, collision, joint limits as bounds. The task adds terms of its own (task_program.h).
///
/// A workspace: the dataset and the collision query, which must be one of the dataset's collision model, must outlive
/// it. One thread.
class WaypointProgram : public Program {
 public:
  /// The constraints of all waypoints; `demands` and their stances need not outlive the call.
  WaypointProgram(const Dataset& dataset, CollisionQuery& query, std::span<const WaypointDemand> demands,
                  const ContactOptions& contacts);

  /// Add a term before or after those that there are. It may refer to the states.
  void Prepend(std::unique_ptr<Term> term) { terms_.insert(terms_.begin(), std::move(term)); }
  /// Likewise, behind those that there are.
  void Append(std::unique_ptr<Term> term) { terms_.push_back(std::move(term)); }

  /// One for each stance given.
  int num_waypoints() const override { return static_cast<int>(states_.size()); }
  int tangent_size() const override { return robot_->tangent_size(); }
  int point_size() const override { return robot_->configuration_size(); }
  /// The constraints, by waypoint, with what Prepend and Append added; owned by the program.
  const std::vector<std::unique_ptr<Term>>& terms() const override { return terms_; }
  /// Where shapes were near each other.
  void Forget() override {
    for (WaypointState& state : states_) state.Forget();
  }
  void SetPoint(Eigen::Ref<const Eigen::VectorXd> x) override;
  void Retract(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<const Eigen::VectorXd> dx,
               Eigen::Ref<Eigen::VectorXd> x_next) const override;
  /// Joints and position are plain sums. A turn by phi of the base, exp(phi) R, moves by phi + d as the local tangent
  /// J(phi) d, with J the left Jacobian of SO(3).
  void PullBack(const double* dx, double* row) const override;
  void StepBounds(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<Eigen::VectorXd> lower,
                  Eigen::Ref<Eigen::VectorXd> upper) const override;
  void ProjectOnBounds(Eigen::Ref<Eigen::VectorXd> x) const override;

  /// Whose waypoints they are.
  const Dataset& dataset() const { return *dataset_; }
  /// The dataset's.
  const RobotModel& robot() const { return *robot_; }
  /// What a waypoint is bound to; without footholds where nothing is demanded.
  const Stance& stance(int waypoint) const { return stances_[static_cast<size_t>(waypoint)]; }
  /// What the terms of a waypoint share; at the point of the last SetPoint.
  WaypointState& state(int waypoint) { return states_[static_cast<size_t>(waypoint)]; }

 private:
  void AddConstraints(const Dataset& dataset, const WaypointDemand& demand, int waypoint,
                      const ContactOptions& contacts);
  bool IsFixed(Eigen::Index waypoint) const { return fixed_[static_cast<size_t>(waypoint)]; }

  const Dataset* dataset_;
  const RobotModel* robot_;
  std::vector<bool> fixed_;           ///< by waypoint
  std::vector<Stance> stances_;       ///< likewise
  std::deque<WaypointState> states_;  ///< terms point into it
  std::vector<std::unique_ptr<Term>> terms_;
};

}  // namespace legopt

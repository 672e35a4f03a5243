#pragma once

#include <Eigen/Core>
#include <deque>
#include <functional>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/problem/program.h"
#include "legopt/problem/terms/internal/transition_terms.h"
#include "legopt/problem/terms/internal/waypoint_terms.h"
#include "legopt/types/collision.h"
#include "legopt/types/physics.h"
#include "legopt/types/task.h"

namespace legopt {

/// Treatment of collisions and physics in a program. Metres.
struct ProgramOptions {
  double margin_m = 5e-4;  ///< distance to keep
  double relaxed_margin_m =
      -5e-4;              ///< relaxed margin, if nothing else helps: half of the depth that the judge tolerates
  double range_m = 0.03;  ///< pairs nearer than this become rows; > margin_m
  ContinuousCollision continuous = ContinuousCollision::kPreferred;  ///< used by programs with transitions
  double continuous_weight = 1e2;                                    ///< weight of the preference, per metre, > 0
  Physics physics = Physics::kNone;          ///< physics at waypoints, beyond the task's balance
  Physics segment_physics = Physics::kNone;  ///< balance of waypoints on the contacts of their segments
  double joint_reserve = 0.0;  ///< distance to keep from joint limits, rad or m, where the range of a joint permits
  bool prefer_middle = false;  ///< on feet, the centre of mass should be far from the edges of its polygon
};

/// Constraints of one waypoint of a chain besides its joint limits.
struct WaypointConstraints {
  const Stance* stance = nullptr;  ///< its feet are planted, nothing collides; null: no terms
  bool fixed = false;              ///< the waypoint does not move
  bool balanced = true;            ///< the centre of mass is over the support polygon of its feet
  bool on_segment = false;         ///< if true, its feet drift on the next segment, and their margin is not relaxed
};

/// A chain of waypoints of one robot, each constrained by a stance: one pose term per foot, the centre of mass over the
/// support polygon of the targets, static equilibrium if the options ask for it, collision, joint limits as bounds. The
/// task adds its own terms (task_program.h).
///
/// A workspace. The dataset and the collision query, which must use the dataset's collision model, must outlive it. One
/// thread.
class WaypointProgram : public Program {
 public:
  /// Adds the constraints of all waypoints; `demands` and their stances need not outlive the call.
  WaypointProgram(const Dataset& dataset, CollisionQuery& query, std::span<const WaypointConstraints> demands,
                  const ProgramOptions& proximity);

  /// Adds a term before the existing ones. It may refer to the states.
  void Prepend(std::unique_ptr<Term> term) { terms_.insert(terms_.begin(), std::move(term)); }
  /// Adds a term after the existing ones. It may refer to the states.
  void Append(std::unique_ptr<Term> term) { terms_.push_back(std::move(term)); }

  /// Removes all terms for which `kept` is false.
  void Keep(const std::function<bool(const Term&)>& kept) {
    std::erase_if(terms_, [&](const std::unique_ptr<Term>& term) { return !kept(*term); });
  }

  /// Adds the preference that the centre of mass is away from the edges of the stance's equilibrium polygon, if all its
  /// contacts are feet: near an edge, contact forces hardly accelerate the robot, which makes a motion slow.
  void PreferMiddle(const Dataset& dataset, const Stance& stance, int waypoint);

  int num_waypoints() const override { return static_cast<int>(states_.size()); }
  int tangent_size() const override { return robot_->tangent_size(); }
  int point_size() const override { return robot_->configuration_size(); }
  /// Returns the constraints, by waypoint, with the terms of Prepend and Append; the program owns them.
  const std::vector<std::unique_ptr<Term>>& terms() const override { return terms_; }
  /// Clears the memory of nearby shapes.
  void ClearCache() override {
    for (WaypointState& state : states_) state.ClearCache();
  }
  void SetPoint(Eigen::Ref<const Eigen::VectorXd> x) override;
  void Retract(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<const Eigen::VectorXd> dx,
               Eigen::Ref<Eigen::VectorXd> x_next) const override;
  /// Joints and base position are plain sums. A base rotation by phi, exp(phi) R, moves with phi + d by the local
  /// tangent J(phi) d, with J the left Jacobian of SO(3).
  void PullBack(const double* dx, double* row) const override;
  void StepBounds(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<Eigen::VectorXd> lower,
                  Eigen::Ref<Eigen::VectorXd> upper) const override;
  void ProjectOnBounds(Eigen::Ref<Eigen::VectorXd> x) const override;

  const Dataset& dataset() const { return *dataset_; }
  const RobotModel& robot() const { return *robot_; }
  /// Returns the stance of a waypoint; without contacts if there are no constraints.
  const Stance& stance(int waypoint) const { return stances_[static_cast<size_t>(waypoint)]; }
  /// Returns the state that the terms of a waypoint share, at the point of the last SetPoint.
  WaypointState& state(int waypoint) { return states_[static_cast<size_t>(waypoint)]; }

 private:
  void AddConstraints(const Dataset& dataset, const WaypointConstraints& demand, int waypoint,
                      const ProgramOptions& proximity);
  void AddAxis(const Contact& contact, const ContactTarget& target, int waypoint);
  void AddTorqueLimits(const Dataset& dataset, const Stance& stance, int waypoint);
  void SetJointBounds(double reserve);
  bool IsFixed(Eigen::Index waypoint) const { return fixed_[static_cast<size_t>(waypoint)]; }

  const Dataset* dataset_;
  const RobotModel* robot_;
  Eigen::VectorXd lower_, upper_;     ///< bounds of the degrees of freedom, with the reserve
  std::vector<bool> fixed_;           ///< one entry per waypoint
  std::vector<Stance> stances_;       ///< one entry per waypoint
  std::deque<WaypointState> states_;  ///< terms point into it
  std::vector<std::unique_ptr<Term>> terms_;
};

/// Stances [first_stance, first_stance + num_stances) of a problem that are solved as one program.
struct StanceWindow {
  int first_stance = 0;  ///< index within the problem
  int num_stances = 0;   ///< >= 1
};

/// Returns the windows of a problem with `num_stances` >= 1 stances, in the order of solving. Posture: one stance per
/// window. Motion: 1 + ceil((N - 6) / 5) windows of six stances, of which the first is shared with the previous window
/// (docs/explanation/paper.md#motion-windows); the last window may be shorter.
std::vector<StanceWindow> StanceWindows(Task task, int num_stances);

/// Creates the program of one window: the constraints of every waypoint (task_program.h), and the task's own terms:
///
///     posture: the torque cost; five terms in double support
///     motion:  the velocity cost as one sampling unit (docs/explanation/paper.md#terms-and-samples), continuous
///              collision between consecutive waypoints as set in `proximity`; 54 units in a full window
///
/// `stances` are those of the window. If `fixed_first`, the first waypoint does not move. Lifetimes as for
/// WaypointProgram.
std::unique_ptr<WaypointProgram> MakeTaskProgram(Task task, const Dataset& dataset, CollisionQuery& query,
                                                 std::span<const Stance> stances, const ProgramOptions& proximity,
                                                 bool fixed_first = false);

/// Ends of a path within a continuous motion that can move: only ends of the whole motion.
struct PathEnds {
  bool first_moves = false;  ///< the path begins where the motion begins
  bool last_moves = false;   ///< the path ends where the motion ends
};

/// Creates the program of a path within a continuous motion, from waypoint to waypoint. Each segment between two
/// waypoints is divided into `pieces` >= 1 of equal time. `stances` are those of the waypoints, at least two. Waypoints
/// satisfy their own stances; a first or last one that cannot move has no terms. At the points within a segment, its
/// planted feet (PlantedContacts) stay on their targets, and nothing collides. Between the points, nothing collides
/// either (SweptCollisionTerm as an inequality, with `step_m` and `sweep`). If `balanced`, the centre of mass is over
/// the planted feet. The cost is the motion's, except for the factor `pieces`. Lifetimes as for WaypointProgram.
std::unique_ptr<WaypointProgram> MakePathProgram(const Dataset& dataset, CollisionQuery& query,
                                                 std::span<const Stance* const> stances, PathEnds ends, int pieces,
                                                 bool balanced, const ProgramOptions& proximity, double step_m,
                                                 Sweep sweep);

/// Returns the optimiser's cost of a whole solution with `waypoints` (n + 7 each). `window_costs` is the sum of the
/// windows' costs, in which shared parts are counted twice.
double SolutionCost(Task task, const RobotModel& robot, std::span<const Eigen::VectorXd> waypoints,
                    double window_costs);

}  // namespace legopt

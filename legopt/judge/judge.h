#pragma once

#include <Eigen/Core>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/dataset/problem_definition.h"
#include "legopt/dynamics/motion_timer.h"
#include "legopt/geometry/internal/exact_collision.h"
#include "legopt/judge/internal/path_examiner.h"
#include "legopt/types/check.h"
#include "legopt/types/task.h"

namespace legopt {

/// Limit of a joint with no limit or a wider one, as in the original: +- this value in rad (m for prismatic joints). It
/// keeps the cost of accepted solutions finite. Kinematics do not clamp to it.
inline constexpr double kUnlimitedJoint = 1e4;

/// How many postures contacts and joints can hold (docs/explanation/judge.md#physical-rule).
struct HoldingScore {
  int postures = 0;             ///< number of measured postures
  int without_equilibrium = 0;  ///< no forces within friction balance the weight
  int over_torque = 0;          ///< forces balance it, but a joint needs more than its effort limit

  HoldingScore& operator+=(const HoldingScore& other) {
    postures += other.postures;
    without_equilibrium += other.without_equilibrium;
    over_torque += other.over_torque;
    return *this;
  }
};

/// The judge's result for one solution.
///
/// The verdict is the *first* failure in the benchmark's order. The maximum violations cover every waypoint that could
/// be evaluated, including later ones.
struct Evaluation {
  /// Value of a figure that was not computed.
  static constexpr double kNotEvaluated = std::numeric_limits<double>::quiet_NaN();

  Verdict literal = Verdict::kSuccess;   ///< the original evaluator's rule: self-collision of the last pair only
  Verdict strict = Verdict::kSuccess;    ///< every listed pair: all contacts and all colliding link pairs count
  Verdict solid = Verdict::kSuccess;     ///< solid bodies: also pairs that the original ignores, containment, steps and
                                         ///< touching contacts
  Verdict physical = Verdict::kSuccess;  ///< the solid rule, and static equilibrium within friction and effort limits
  int failed_waypoint = -1;              ///< waypoint of the failure by the most lenient failing rule; -1: none
  std::string detail;                    ///< description of that failure: foot, joint or link, and magnitude; empty for
                                         ///< a success

  /// Largest value of each check over all waypoints that were evaluated, by the most lenient rule that counts it, even
  /// if it is within tolerance. A check that was never made has none (no waypoint had the right size, or phase A
  /// failed).
  std::vector<Violation> violations;

  InterpolationScore interpolation;    ///< set by tasks scored between waypoints; independent of the verdict
  HoldingScore holding;                ///< equilibrium at waypoints; empty if one failed in phase A
  std::optional<MotionTiming> timing;  ///< time law of a timed motion that passes all other checks
  HoldingScore holding_halfway;  ///< equilibrium half way between waypoints, with the contacts of both; not part of a
                                 ///< verdict

  /// For a motion with an unsolved window: the failure of that window's best point by the most lenient failing rule, or
  /// success if none fails. Empty if no window is unsolved, or the window was not started.
  std::optional<Verdict> window;

  double cost = kNotEvaluated;  ///< see Judge; NaN unless `literal` is success
  int num_waypoints = 0;        ///< number of constraint waypoints: divisor of cost and time

  Verdict& by(Rule rule);       ///< returns the verdict of one rule
  Verdict by(Rule rule) const;  ///< returns the verdict of one rule

  /// Returns the largest value of a check by `rule`, in the unit of the check; NaN if it was not made.
  double Largest(Verdict check, Rule rule) const;
  /// Returns the largest contact depth by the solid rule, m: with the scene, between links, and inside closed
  /// bodies; NaN if collisions were not checked.
  double SolidDepth_m() const;

  /// Returns the finite `violations` that results store: a stricter rule's value only if it is larger.
  std::vector<Violation> StoredViolations() const;

  /// Failure by the most lenient failing rule; success if there is none.
  Verdict first_failure() const;
};

/// Decides whether a solution solves a problem, exactly like the LegOpt evaluator
/// (docs/explanation/judge.md), with exact triangle meshes, and computes its cost. This class alone defines
/// success.
///
/// Phase A, waypoint by waypoint: size, finite numbers, foot poses, COM, joint limits. Kinematics use the joints
/// clamped to their limits, the limit test the raw vector. Phase B, only if A passed everywhere: environment,
/// self-collision; for the solid rule also containment, the step from the previous waypoint and touching contacts; for
/// the physical rule static equilibrium and torques. Phase C: cost per waypoint, W = num_waypoints, depending on the
/// task (legopt/types/task.h):
///
///     torques:      1/W sum_w sum_i tau_i^2        tau: gravity torques with the base held fixed, N m
///     joint steps:  1/W sum_w |q_w - q_{w-1}|^2    raw joint values, base excluded
///     duration:     T* / stances                   least duration, s (legopt/dynamics/motion_timer.h)
///
/// The interpolation is also scored if the task requires it. Contains kinematics and collision workspaces: not
/// thread-safe; the dataset is shared. The constructor builds the dataset's collision model if necessary, and throws
/// InputError for a corrupt mesh.
class Judge {
 public:
  /// `culling`: kOff compares all meshes exactly, which takes about a hundred times as long and must not change any
  /// figure.
  explicit Judge(std::shared_ptr<const Dataset> dataset, Culling culling = Culling::kOn);
  ~Judge();
  /// A moved-from judge may only be destroyed or assigned to.
  Judge(Judge&&) noexcept;
  Judge& operator=(Judge&&) noexcept;

  const Dataset& dataset() const;

  /// Evaluates a solution. `problem` need not belong to the dataset, but must fit the task, and its links must be feet
  /// of the dataset; otherwise throws InputError with problem and stance, without a file. `waypoints` hold n + 7
  /// numbers each; the quaternion (wxyz) need not be unit. Bad solutions do not throw but get a verdict.
  Evaluation Evaluate(Task task, const ProblemDefinition& problem, std::span<const Eigen::VectorXd> waypoints);

  /// Evaluates a part of a motion: the waypoints (n + 7 numbers each) of consecutive stances, starting with
  /// `first_stance`. Waypoints are numbered as in the whole motion; segments between them are not checked.
  Evaluation EvaluatePart(Task task, const ProblemDefinition& problem, int first_stance,
                          std::span<const Eigen::VectorXd> waypoints);

 private:
  class Workspace;
  std::unique_ptr<Workspace> workspace_;
};

}  // namespace legopt

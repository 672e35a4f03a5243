#pragma once

#include <Eigen/Core>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "legopt/dataset/dataset.h"
#include "legopt/dataset/stance.h"
#include "legopt/geometry/culling.h"
#include "legopt/judge/interpolation.h"
#include "legopt/types/result.h"
#include "legopt/types/task.h"

namespace legopt {

/// Tolerances of the benchmark: larger values fail, equal ones pass (docs/explanation/judge.md#order-and-tolerances).
inline constexpr double kPoseTolerance = 1e-3;     ///< quaternion vector part (1) and translation (m)
inline constexpr double kComTolerance_m = 1e-3;    ///< distance outside the support polygon
inline constexpr double kLimitTolerance = 1e-3;    ///< rad or m beyond a joint limit
inline constexpr double kDepthTolerance_m = 1e-3;  ///< contact depth

/// Maximum movement of any point of the robot between consecutive waypoints under Rule::kSolid, the physical rule, as a
/// fraction of the robot's size: the diagonal of Dataset::robot_bounds (docs/explanation/judge.md#solid-rule).
inline constexpr double kStepShare = 1.0;

/// Limit of a joint with no limit or a wider one, as in the original: +- this value in rad (m for prismatic joints). It
/// keeps the cost of accepted solutions finite. Kinematics do not clamp to it.
inline constexpr double kUnlimitedJoint = 1e4;

/// The judge's result for one solution.
///
/// The verdict is the *first* failure in the benchmark's order. The maximum violations cover every waypoint that could
/// be evaluated, including later ones. A figure that was never evaluated is NaN (no waypoint had the right size, or
/// phase A failed and collisions were not checked).
struct Evaluation {
  /// Value of a figure that was not computed.
  static constexpr double kNotEvaluated = std::numeric_limits<double>::quiet_NaN();

  Verdict literal = Verdict::kSuccess;  ///< the original evaluator's rule: self-collision of the last pair only
  Verdict strict = Verdict::kSuccess;   ///< every listed pair: all contacts and all colliding link pairs count
  Verdict solid = Verdict::kSuccess;    ///< physical rule (solid bodies): also pairs that the original ignores,
                                        ///< containment and steps
  int failed_waypoint = -1;             ///< waypoint of the failure by the most lenient failing rule; -1: none
  std::string detail;                   ///< description of that failure: foot, joint or link, and magnitude; empty for
                                        ///< a success

  // Maxima over all waypoints that were evaluated; >= 0.
  double foot_violation = kNotEvaluated;        ///< pose error component: quaternion vector part (1), translation (m)
  double com_violation_m = kNotEvaluated;       ///< distance of the COM outside the support polygon, 0 inside
  double limit_violation = kNotEvaluated;       ///< distance of the raw vector beyond a joint limit, rad (m for
                                                ///< prismatic)
  double environment_depth_m = kNotEvaluated;   ///< contact depth with the scene, by the original evaluator's rule
  double self_depth_literal_m = kNotEvaluated;  ///< contact depth of the last colliding pair of each waypoint
  double self_depth_strict_m = kNotEvaluated;   ///< contact depth of all colliding pairs
  /// Contact depth with the scene and of all pairs, and depth of vertices inside closed bodies, by the physical rule.
  double solid_depth_m = kNotEvaluated;
  double longest_step_m = kNotEvaluated;  ///< longest step of any point between waypoints; 0 for one waypoint

  InterpolationScore interpolation;  ///< set by tasks scored between waypoints; independent of the verdict

  /// For a motion with an unsolved window: the failure of that window's best point by the most lenient failing rule, or
  /// success if none fails. Empty if no window is unsolved, or the window was not started.
  std::optional<Verdict> window;

  double cost = kNotEvaluated;  ///< see Judge; NaN unless `literal` is success
  int num_waypoints = 0;        ///< number of constraint waypoints: divisor of cost and time

  Verdict by(Rule rule) const;  ///< returns the verdict of one rule

  /// Failure by the most lenient failing rule; success if there is none.
  Verdict first_failure() const;
};

/// Decides whether a solution solves a problem, exactly like the LegOpt evaluator
/// (docs/explanation/judge.md), with exact triangle meshes, and computes its cost. This class alone defines
/// success.
///
/// Phase A, waypoint by waypoint: size, finite numbers, foot poses, COM, joint limits. Kinematics use the joints
/// clamped to their limits, the limit test the raw vector. Phase B, only if A passed everywhere: environment,
/// self-collision; for the physical rule also containment and the step from the previous waypoint. Phase C: cost per
/// waypoint, W = num_waypoints, depending on the task (legopt/types/task.h):
///
///     torques:      1/W sum_w sum_i tau_i^2        tau: gravity torques with the base held fixed, N m
///     joint steps:  1/W sum_w |q_w - q_{w-1}|^2    raw joint values, base excluded
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

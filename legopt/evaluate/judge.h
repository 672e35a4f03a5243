#pragma once

#include <Eigen/Core>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "legopt/collision/culling.h"
#include "legopt/dataset/dataset.h"
#include "legopt/dataset/stance.h"
#include "legopt/evaluate/interpolation.h"
#include "words/result.h"
#include "words/task.h"

namespace legopt {

/// Tolerances of the benchmark: a value above them fails, equality passes (docs/readings.md#order-and-tolerances).
inline constexpr double kPoseTolerance = 1e-3;     ///< quaternion vector part (1) and translation (m)
inline constexpr double kComTolerance_m = 1e-3;    ///< outside the support polygon
inline constexpr double kLimitTolerance = 1e-3;    ///< rad or m beyond a joint limit
inline constexpr double kDepthTolerance_m = 1e-3;  ///< contact depth

/// Under Rule::kSolid, farthest that a point of the robot may move between consecutive waypoints, as a share of the
/// robot's size: the diagonal of Dataset::robot_bounds (docs/readings.md#solid-rule).
inline constexpr double kStepShare = 1.0;

/// Limits of a joint that has none (or wider ones), as in the original: +- this many rad (m for prismatic joints). It
/// keeps every accepted cost finite. Kinematics do not clamp to it.
inline constexpr double kUnlimitedJoint = 1e4;

/// What the judge found out about one solution.
///
/// The verdict is the *first* failure in the benchmark's order; the largest violations cover every waypoint that could
/// be evaluated, also after it. A figure that was never evaluated is NaN (no waypoint had the right size, or phase A
/// failed and collisions were not looked at).
struct Evaluation {
  /// A figure that nobody has computed.
  static constexpr double kNotEvaluated = std::numeric_limits<double>::quiet_NaN();

  Verdict literal = Verdict::kSuccess;  ///< by the original evaluator's rule: self-collision of the last pair only
  Verdict strict = Verdict::kSuccess;   ///< every colliding link pair and every contact counts
  Verdict solid = Verdict::kSuccess;    ///< also pairs that the original ignores, containment and steps
  int failed_waypoint = -1;             ///< of the failure by the most lenient rule that fails; -1: none
  std::string detail;                   ///< of it, for a human: which foot, joint or link, by how much; empty: success

  // Largest over all waypoints that were evaluated; >= 0.
  double foot_violation = kNotEvaluated;        ///< pose error component: quaternion vector part (1), translation (m)
  double com_violation_m = kNotEvaluated;       ///< distance of the COM outside the support polygon, 0 inside
  double limit_violation = kNotEvaluated;       ///< excess of the raw vector over a joint limit, rad (m for prismatic)
  double environment_depth_m = kNotEvaluated;   ///< contact depth with the scene, by the literal rule
  double self_depth_literal_m = kNotEvaluated;  ///< contact depth of the last colliding pair of each waypoint
  double self_depth_strict_m = kNotEvaluated;   ///< contact depth of all colliding pairs
  /// By the solid rule: contact depth with the scene and of all pairs, depth of vertices inside of closed bodies.
  double solid_depth_m = kNotEvaluated;
  double longest_step_m =
      kNotEvaluated;  ///< of any point of the robot between consecutive waypoints; 0 for one waypoint

  InterpolationScore interpolation;  ///< of tasks scored between waypoints, whatever the verdict; no part of it

  /// Of a motion with an unsolved window: the failure of that window's best point by the most lenient rule that it
  /// fails; success: it fails none. Empty: no window is unsolved, or the window was not begun.
  std::optional<Verdict> window;

  double cost = kNotEvaluated;  ///< see Judge; NaN unless `literal` is success
  int num_waypoints = 0;        ///< constraint waypoints: divisor of cost and time

  Verdict by(Rule rule) const;  ///< the verdict of one rule

  /// The failure by the most lenient rule that fails; success if none does.
  Verdict first_failure() const;
};

/// Decides whether a solution solves a problem, exactly as the LegOpt evaluator does (docs/readings.md#the-judge), with
/// exact triangle meshes, and computes its cost. Success is only what this class says.
///
/// Phase A, waypoint by waypoint: size, finite numbers, foot poses, COM, joint limits. Kinematics use the joints
/// clamped to their limits, the limit test the raw vector. Phase B, only if A passed everywhere: environment,
/// self-collision; by the solid rule then containment and the step from the waypoint before. Phase C, cost per
/// waypoint, W = num_waypoints, as the task is described (words/task.h):
///
///     torques:      1/W sum_w sum_i tau_i^2        tau: gravity torques with the base held fixed, N m
///     joint steps:  1/W sum_w |q_w - q_{w-1}|^2    raw joint values, base excluded
///
/// Beside it the interpolation is scored where the task says that what lies between waypoints is.
/// Holds kinematics and collision workspaces: one thread at a time; the dataset is shared. Construction builds the
/// dataset's collision model if nobody has yet, and throws InputError when a mesh is corrupt.
class Judge {
 public:
  /// `dataset`: shared with the judge. See above for what this costs and throws. `culling`: kOff compares all meshes
  /// exactly, which takes some hundred times as long and may not change any figure.
  explicit Judge(std::shared_ptr<const Dataset> dataset, Culling culling = Culling::kOn);
  ~Judge();
  /// What is moved from may only be destroyed or assigned to.
  Judge(Judge&&) noexcept;
  /// Likewise.
  Judge& operator=(Judge&&) noexcept;

  const Dataset& dataset() const;  ///< as given at construction

  /// `problem` need not be one of the dataset's, but it must fit the task, and its links must be feet of the dataset:
  /// else InputError that names problem and stance, and no file. `waypoints` hold n + 7 numbers each; the quaternion
  /// (wxyz) need not be unit. Bad solutions never throw: they get a verdict.
  Evaluation Evaluate(Task task, const ProblemDefinition& problem, std::span<const Eigen::VectorXd> waypoints);

  /// The same for a part of a motion: the waypoints (n + 7 numbers each) of consecutive stances, `first_stance` the
  /// first of them. Waypoints are numbered as in the whole motion; segments between them are not looked at.
  Evaluation EvaluatePart(Task task, const ProblemDefinition& problem, int first_stance,
                          std::span<const Eigen::VectorXd> waypoints);

 private:
  class Workspace;
  std::unique_ptr<Workspace> workspace_;
};

}  // namespace legopt

#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <deque>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/dynamics/path_spline.h"
#include "legopt/geometry/internal/exact_collision.h"
#include "legopt/judge/internal/holding_probe.h"
#include "legopt/robot/kinematics.h"
#include "legopt/robot/robot_model.h"
#include "legopt/types/check.h"
#include "legopt/types/task.h"

namespace legopt {

/// A path in time through the waypoints of a motion: a solution of a continuous task
/// (docs/explanation/judge.md#continuous-motions). Points are connected by the interpolation of robot/configuration.h.
///
/// In files, messages and databases a point is n + 8 numbers: a configuration (n + 7), then its time stamp. Time is
/// measured in segments: waypoint w is the point at time w.
struct TimedPath {
  std::vector<Eigen::VectorXd> points;  ///< configurations, n + 7 each
  std::vector<double> times;            ///< time of each point, increasing from 0
  std::vector<std::size_t> waypoints;   ///< point indices of waypoints 0, 1, ...; the last one is the last point
};

/// A fault in the numbers of a path.
struct PathDiagnostic {
  Verdict verdict{};   ///< wrong number of waypoints; wrong size, also for misplaced time stamps; not finite
  int waypoint = -1;   ///< waypoint at or before the fault; -1: the whole path
  std::string detail;  ///< the point, and the expected value
};

/// Parses `points` (n + 8 numbers each, see TimedPath) of a motion with `num_waypoints` >= 2. Time stamps must start at
/// 0, increase, contain the time of every waypoint exactly and end at the last one. Each segment may have at most
/// kMaxPieces pieces. `path` is complete if no fault is returned.
std::optional<PathDiagnostic> ParsePath(std::span<const Eigen::VectorXd> points, int num_waypoints,
                                        int configuration_size, TimedPath* path);

/// Builds the path through waypoints and intermediate points: `ways` has the points of each segment, at equal intervals
/// in time.
TimedPath MakePath(std::span<const Eigen::VectorXd> waypoints, std::span<const std::vector<Eigen::VectorXd>> ways);

/// Returns the points of a path in their stored form.
std::vector<Eigen::VectorXd> FormatPath(const TimedPath& path);

/// Number of configurations checked strictly between two consecutive waypoints: t = k / (steps + 1), k = 1 .. steps.
inline constexpr int kInterpolationSteps = 10;

/// Collisions between the waypoints of a motion under direct interpolation. Not part of the verdict: neither the paper
/// nor its evaluator checks it. NaN: not evaluated.
struct InterpolationScore {
  /// Value of a figure that was not computed.
  static constexpr double kNotEvaluated = std::numeric_limits<double>::quiet_NaN();

  double environment_depth_m = kNotEvaluated;  ///< maximum contact depth with the scene, >= 0
  double self_depth_m = kNotEvaluated;         ///< maximum contact depth of all colliding link pairs, >= 0
  double free_share = kNotEvaluated;           ///< share of transitions without a depth above kFreeDepth_m, 0 .. 1
};

/// Maximum depth of a collision-free transition, m: the judge's tolerance.
inline constexpr double kFreeDepth_m = 1e-3;

/// Returns a configuration as used by the judge's kinematics: joints clamped to their limits, unit quaternion.
Eigen::VectorXd ClampedConfiguration(const RobotModel& robot, const Eigen::VectorXd& waypoint);

/// Scores the transitions between all consecutive waypoints, with exact meshes, on the path of robot/configuration.h.
/// Joints are clamped to their limits first, as for the verdict; quaternions may have any non-zero norm. `kinematics`
/// and `collision` are workspaces of the robot. Evaluates nothing if there are fewer than two waypoints, or if one is
/// not n + 7 finite numbers of reasonable size with a non-zero quaternion.
InterpolationScore ScoreInterpolation(std::span<const Eigen::VectorXd> waypoints, Kinematics& kinematics,
                                      ExactCollision& collision);

/// Tolerances between the waypoints of a continuous motion (docs/explanation/judge.md#continuous-motions): for feet and
/// centre of mass twice those at waypoints, since interpolated paths deviate between their points.
inline constexpr double kPlantedTolerance = 2e-3;      ///< planted foot: quaternion vector part (1), translation (m)
inline constexpr double kPathComTolerance_m = 2e-3;    ///< distance outside the support polygon of the planted feet
inline constexpr double kPathDepthTolerance_m = 1e-3;  ///< contact depth: all contacts and all pairs of the strict rule
                                                       ///< (every listed pair)

/// Maximum movement of a vertex of the robot between consecutive samples of a path, m.
inline constexpr double kPathSample_m = 5e-3;
/// Maximum rotation of a joint or the base between consecutive samples, rad (m for prismatic joints).
inline constexpr double kPathSampleTurn = 0.1;
/// Maximum movement of a vertex in one piece, m; longer pieces fail and are not sampled.
inline constexpr double kLongestPiece_m = 10.0;
/// Maximum rotation of a joint or the base in one piece, rad (m for prismatic joints).
inline constexpr double kLargestPieceTurn = 12.0;

/// Findings between the waypoints of a path.
struct PathExamination {
  Verdict verdict = Verdict::kSuccess;  ///< first failing sample's, in the order of checks at a waypoint
  int waypoint = -1;                    ///< waypoint before the failure; -1: no failure
  std::string detail;                   ///< description of the failure
  std::vector<Violation> violations;    ///< largest values of planted contacts and of the centre of mass, if checked
  InterpolationScore score;             ///< depths, and the share of segments without a failure
};

/// Samples a path so densely that no vertex of the robot moves more than kPathSample_m between consecutive samples, end
/// points included. Checks planted feet (PlantedContacts) against their targets, contact depths with exact meshes and,
/// for balanced tasks, the centre of mass over the planted feet, or in the equilibrium polygon if hands carry. Joints
/// are clamped to their limits first, as at waypoints. For tasks with a time law, the points are joined by a spline
/// (legopt/dynamics/path_spline.h), which must also keep the joint limits. Uses the judge's workspaces: not
/// thread-safe.
class PathExaminer {
 public:
  /// The arguments must outlive this object.
  PathExaminer(const Dataset& dataset, ExactCollision& collision);

  /// Examines a solution of `problem`. `path`: valid (ParsePath), all numbers finite and of reasonable size.
  PathExamination Examine(Task task, const ProblemDefinition& problem, const TimedPath& path);

 private:
  struct Segment;
  void ExamineSegment(const Segment& segment, const TimedPath& path, PathExamination* findings);
  void ExaminePiece(const Segment& segment, PathExamination* findings);
  void Bisect(const Segment& segment, std::size_t level, double s_from, const Kinematics& at_from, double s_to,
              const Kinematics& at_to, PathExamination* findings);
  void ExamineSample(const Segment& segment, double s, const Kinematics& kinematics, PathExamination* findings);
  void Fail(const Segment& segment, double s, Verdict verdict, const std::string& detail, PathExamination* findings);
  void CheckCurveLimits(const Segment& segment, double s, PathExamination* findings);
  double LargestTurn() const;
  void Place(double s, Kinematics* kinematics);
  double TimeAt(double s) const { return t_from_ + s * (t_to_ - t_from_); }
  Kinematics& Level(std::size_t level);

  const Dataset* dataset_;
  ExactCollision* collision_;
  HoldingProbe holding_;
  std::deque<Kinematics> levels_;  ///< per level of the bisection; grows
  Eigen::VectorXd x_;
  std::optional<PathSpline> spline_;  ///< spline through the current path, if its task has a time law
  CurvePoint point_;
  // State of the current piece.
  Eigen::VectorXd from_, to_;
  double t_from_ = 0.0, t_to_ = 0.0, turn_ = 0.0;
  bool segment_failed_ = false;
};

}  // namespace legopt

#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <deque>
#include <string>

#include "legopt/collision/exact_collision.h"
#include "legopt/dataset/dataset.h"
#include "legopt/evaluate/interpolation.h"
#include "legopt/evaluate/timed_path.h"
#include "legopt/robot/kinematics.h"
#include "words/result.h"
#include "words/task.h"

namespace legopt {

/// Tolerances between the waypoints of a continuous motion (docs/readings.md#continuous-motions): twice what holds at
/// waypoints, as a path bends away from its points.
inline constexpr double kPlantedTolerance = 2e-3;    ///< of a planted foot: quaternion vector part (1), translation (m)
inline constexpr double kPathComTolerance_m = 2e-3;  ///< outside of the support polygon of the planted feet
inline constexpr double kPathDepthTolerance_m = 1e-3;  ///< contact depth, all contacts and all pairs of the strict rule

/// Farthest that a vertex of the robot moves from one sample of a path to the next, m.
inline constexpr double kPathSample_m = 5e-3;
/// Likewise a joint, or the base in its turn, rad (m for prismatic joints).
inline constexpr double kPathSampleTurn = 0.1;
/// Farthest that a vertex may move in one piece, m; what moves farther fails and is not sampled.
inline constexpr double kLongestPiece_m = 10.0;
/// Likewise a joint or the base in its turn, rad (m for prismatic joints).
inline constexpr double kLargestPieceTurn = 12.0;

/// What happens between the waypoints of a path.
struct PathFindings {
  Verdict verdict = Verdict::kSuccess;  ///< of the first sample that fails, in the order of a waypoint's checks
  int waypoint = -1;                    ///< the one before it; -1: nothing fails
  std::string detail;                   ///< of it, for a human
  double foot_violation = 0.0;          ///< of planted feet, largest; quaternion vector part (1), translation (m)
  double com_violation_m = 0.0;         ///< largest distance outside of the polygon of the planted feet; 0 unless asked
  InterpolationScore score;             ///< depths, and the share of ways from waypoint to waypoint without a failure
};

/// Looks at a path so closely that no vertex of the robot moves more than kPathSample_m from one sample to the next,
/// points included: planted feet (PlantedFeet) on their targets, contact depths by the exact meshes, and by
/// Between::kBalanced the centre of mass over the planted feet. Joints are clamped to their limits first, as at
/// waypoints. A workspace on those of the judge: one thread at a time.
class PathExaminer {
 public:
  /// All must outlive it.
  PathExaminer(const Dataset& dataset, ExactCollision& collision);

  /// `path`: well formed (TakeApart), all numbers finite and of reasonable size, of `problem`.
  PathFindings Examine(Task task, const ProblemDefinition& problem, const TimedPath& path);

 private:
  struct Way;
  void ExamineWay(const Way& way, const TimedPath& path, PathFindings* findings);
  void ExaminePiece(const Way& way, PathFindings* findings);
  void Bisect(const Way& way, std::size_t level, double s_from, const Kinematics& at_from, double s_to,
              const Kinematics& at_to, PathFindings* findings);
  void ExamineSample(const Way& way, double s, const Kinematics& kinematics, PathFindings* findings);
  void Fail(const Way& way, double s, Verdict verdict, const std::string& detail, PathFindings* findings);
  double LargestTurn() const;
  Kinematics& Level(std::size_t level);

  const Dataset* dataset_;
  ExactCollision* collision_;
  std::deque<Kinematics> levels_;  ///< of a bisection; grows
  Eigen::VectorXd x_;
  // Of the piece at hand.
  Eigen::VectorXd from_, to_;
  double t_from_ = 0.0, t_to_ = 0.0, turn_ = 0.0;
  bool way_failed_ = false;
};

}  // namespace legopt

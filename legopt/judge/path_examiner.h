#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <deque>
#include <string>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/geometry/exact_collision.h"
#include "legopt/judge/interpolation.h"
#include "legopt/judge/timed_path.h"
#include "legopt/robot/kinematics.h"
#include "legopt/types/check.h"
#include "legopt/types/task.h"

namespace legopt {

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
/// for Between::kBalanced, the centre of mass over the planted feet. Joints are clamped to their limits first, as at
/// waypoints. Uses the judge's workspaces: not thread-safe.
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
  double LargestTurn() const;
  Kinematics& Level(std::size_t level);

  const Dataset* dataset_;
  ExactCollision* collision_;
  std::deque<Kinematics> levels_;  ///< per level of the bisection; grows
  Eigen::VectorXd x_;
  // State of the current piece.
  Eigen::VectorXd from_, to_;
  double t_from_ = 0.0, t_to_ = 0.0, turn_ = 0.0;
  bool segment_failed_ = false;
};

}  // namespace legopt

#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <deque>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/geometry/collision_query.h"
#include "legopt/planning/internal/multi_start.h"
#include "legopt/problem/terms/task_program.h"
#include "legopt/robot/kinematics.h"
#include "legopt/robot/robot_model.h"
#include "legopt/solvers/solver.h"
#include "legopt/types/task.h"

namespace legopt {

/// Checks whether the robot collides on the path between two configurations, according to the solver's own shapes.
///
/// Between two samples, a link that moves by at most `way` comes no nearer to the scene than half of (the sum of its
/// distances at both samples, minus `way`). The same holds for two links, with the displacement of one in the frame of
/// the other. If this does not exclude a distance below kClearance_m, the interval is bisected, so that samples are
/// dense only near obstacles. Displacements are measured as straight lines of the links' bounding balls, which is
/// accurate to a few per mille at kLargestTurn.
///
/// A workspace; one thread.
class PathClearance {
 public:
  /// Distance to keep, m. If surfaces only just touch at an edge, the judge's contact depth, which is measured along
  /// face normals, may be centimetres.
  static constexpr double kClearance_m = 5e-5;
  /// Largest rotation of a joint or the base between samples, rad (m for prismatic joints).
  static constexpr double kLargestTurn = 0.2;

  /// Both must outlive this object; `query` uses the robot's collision model. Distances above `range_m` > 0 are not
  /// computed, which only changes the number of samples.
  PathClearance(const RobotModel& robot, CollisionQuery& query, double range_m);

  /// Returns whether the path of robot/configuration.h between two configurations (n + 7 each) is free, including both
  /// ends.
  bool IsFree(Eigen::Ref<const Eigen::VectorXd> from, Eigen::Ref<const Eigen::VectorXd> to);
  /// Deepest contact of the last sample that was not free.
  const ProximityPair& obstacle() const { return obstacle_; }

 private:
  /// One configuration: distances of each link to the scene and of each checked pair, at most the range, m.
  struct Sample {
    explicit Sample(const RobotModel& robot) : kinematics(robot) {}
    Kinematics kinematics;
    std::vector<double> scene_m;
    std::vector<double> pairs_m;
    ProximityPair nearest;
  };
  Sample& Level(std::size_t level);
  void Place(double s, Sample* sample);
  bool IsFreeAt(const Sample& sample);
  bool Excluded(const Sample& a, const Sample& b) const;
  bool Bisect(std::size_t level, double s_a, const Sample& a, double s_b, const Sample& b);

  const RobotModel* robot_;
  CollisionQuery* query_;
  WarmStartCache memory_;  ///< speeds up queries at nearby samples
  double range_m_;
  std::vector<int> pair_index_;  ///< index of each checked pair (first, second); -1: not checked
  std::deque<Sample> levels_;
  Eigen::VectorXd from_, to_, x_;
  double turn_ = 0.0;
  ProximityPair obstacle_;
};

/// A part of a continuous motion, from one waypoint to another.
struct WaypointPath {
  std::vector<const Stance*> stances;              ///< stances of its waypoints, at least two
  std::vector<Eigen::VectorXd> waypoints;          ///< parallel to stances; n + 7 numbers each
  std::vector<std::vector<Eigen::VectorXd>> ways;  ///< inner points of each segment, equally spaced in time
  PathEnds ends = {};                              ///< whether its first and its last waypoint can move

  size_t num_segments() const { return waypoints.size() - 1; }  ///< number of segments between waypoints
};

/// Result of PathSolver::Solve.
struct PathSolution {
  WaypointPath waypoint_path;                            ///< best path found
  bool feasible = false;                                 ///< feasible according to the solver
  SolveStatus status = SolveStatus::kConvergedFeasible;  ///< status of the last solve, or of a stop
  double max_violation = 0.0;                            ///< violation in the last program
  double margin_relaxed = 0.0;                           ///< SolverResult::margin_relaxed of the last program
  int restarts = 0;                                      ///< attempts beyond the first
  Effort effort;                                         ///< effort of all attempts
  std::string message;                                   ///< reason of a failure: the largest violation
};

/// Number of equal pieces of a segment that are divided further where a spline that joins the points needs it. Also the
/// largest number in programs of several segments that a spline joins.
inline constexpr int kPiecesToDivide = kMaxPieces / 2;

/// Plans the path between the waypoints of a motion: planted feet stay on their targets, nothing collides and, for
/// Between::kBalanced, the centre of mass stays over the planted feet (docs/explanation/judge.md#continuous-motions).
///
/// One segment: its waypoints do not move. A straight segment is kept if it is acceptable. Otherwise it is divided into
/// pieces. Between points, planted feet leave their targets by the square of a piece's length, which determines the
/// number of pieces. The method's own solver solves the program of the inner points (MakePathProgram) from the straight
/// segment. If the result is infeasible, planted feet or the centre of mass still drift too far, or something collides
/// between the points, the solve is repeated from there with twice as many pieces, up to kMaxPieces. Several
/// segments: the same, from their current points; the waypoints between them move, and so do the ends that may.
///
/// A workspace; one thread.
class PathSolver {
 public:
  /// All arguments must outlive this object. `proximity` is the same as in the motion's own programs.
  PathSolver(const Dataset& dataset, CollisionQuery& query, Solver& solver, Task task, const ProgramOptions& proximity);

  /// Solves for the path from the points of `start`, with at least `least_pieces` pieces per segment. `attempts`
  /// returns the settings used for windows, with generator and perturb for this program's points.
  PathSolution Solve(const WaypointPath& start, const std::function<MultiStartSettings()>& attempts,
                     int least_pieces = 1);

  /// Selects the segments that FaultOf examines; `stances`: of their waypoints, at least two.
  void Bind(std::span<const Stance* const> stances);
  /// Returns the first rule that a curve on the only segment of the last Bind breaks; empty if there is none.
  /// `samples`: configurations on it, so dense that they may be joined by straight pieces.
  std::string FaultOf(std::span<const Eigen::VectorXd> samples);

  /// Returns the number of term evaluations so far, including those of a running solve.
  std::int64_t Evaluations() const;
  /// Returns the weighted sum of these evaluations (Program::TermWork_ns).
  std::int64_t Work_ns() const;

 private:
  bool IsFree(const Eigen::VectorXd& points);
  double Drift(const Eigen::VectorXd& points);
  double ComDeviation(const Eigen::VectorXd& points);
  template <class Visit>
  void ForEachMiddle(const Eigen::VectorXd& points, Visit visit);
  bool SolvePieces(const MultiStartSettings& attempts, Program& program, Eigen::VectorXd& points,
                   PathSolution* solution);
  bool IsAcceptable(const Eigen::VectorXd& points, PathSolution* solution);
  int InitialPieces(const WaypointPath& start, const Eigen::VectorXd& ends, int least_pieces);
  Eigen::VectorXd Subdivided(const Eigen::VectorXd& points, int pieces) const;
  Eigen::VectorXd PointsOf(const WaypointPath& waypoint_path, int pieces) const;
  WaypointPath PathThroughPoints(const WaypointPath& start, const Eigen::VectorXd& points) const;

  const Dataset* dataset_;
  CollisionQuery* query_;
  Solver* solver_;
  Task task_;
  ProgramOptions proximity_;
  PathClearance clearance_;
  Kinematics kinematics_;
  Eigen::VectorXd x_;
  // Data of the current path, one entry per segment.
  std::vector<Stance> planted_;
  std::vector<std::vector<Eigen::Vector2d>> polygons_;  ///< polygons of balance on the planted contacts; may be empty
  std::int64_t evaluations_ = 0;                        ///< evaluations of finished programs
  std::int64_t work_ns_ = 0;                            ///< their weighted sum
  const Program* program_ = nullptr;                    ///< program that is being solved
};

}  // namespace legopt

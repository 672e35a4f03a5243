#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "legopt/collision/collision_query.h"
#include "legopt/dataset/dataset.h"
#include "legopt/optimize/solver.h"
#include "legopt/robot/kinematics.h"
#include "legopt/solve/multi_start.h"
#include "legopt/solve/path_clearance.h"
#include "legopt/terms/task_program.h"
#include "words/task.h"

namespace legopt {

/// A part of a continuous motion, from a waypoint to another.
struct Stretch {
  std::vector<const Stance*> stances;              ///< of its waypoints, two at least
  std::vector<Eigen::VectorXd> waypoints;          ///< parallel; n + 7 each
  std::vector<std::vector<Eigen::VectorXd>> ways;  ///< points between, by way, at equal distances in time
  PathEnds ends = {};                              ///< whether its first and its last waypoint move

  size_t num_ways() const { return waypoints.size() - 1; }  ///< from waypoint to waypoint
};

/// What became of it.
struct StretchSolution {
  Stretch stretch;                                       ///< the best that was found
  bool feasible = false;                                 ///< by the solver's own measure
  SolveStatus status = SolveStatus::kConvergedFeasible;  ///< of the last solve; a stop, if there was one
  double max_violation = 0.0;                            ///< of the last program
  int restarts = 0;                                      ///< attempts beyond the first
  Effort effort;                                         ///< of all
  std::string message;                                   ///< of a failure: the largest violation
};

/// Leads motions from waypoint to waypoint: planted feet stay, nothing collides on the way, by Between::kBalanced the
/// centre of mass stays over the planted feet (docs/readings.md#continuous-motions).
///
/// One way: its waypoints do not move. A straight one that will do is kept. Otherwise it is cut into so many pieces
/// that planted feet, which leave their targets by the square of a piece's length, stay near enough between them, and
/// the program of its inner points (MakePathProgram) is solved from the straight way by the method's own solver; when
/// that is not feasible, planted feet or the centre of mass still drift too far, or something collides between the
/// points, from there with twice as many pieces, up to kMostPieces. Several ways: likewise, from the points that they
/// have, and the waypoints between them move, too, and the ends that may.
///
/// A workspace; one thread.
class PathSolver {
 public:
  /// All must outlive it. `contacts` as for the motion's own programs.
  PathSolver(const Dataset& dataset, CollisionQuery& query, Solver& solver, Task task, const ContactOptions& contacts);

  /// `attempts` as for windows, but perturb and generator, which are of this program's points.
  StretchSolution Solve(const Stretch& start, const std::function<MultiStartSettings()>& attempts);

  /// Term evaluations so far, those of a solve at hand included.
  std::int64_t Evaluations() const;

 private:
  bool IsFree(const Eigen::VectorXd& points);
  double Drift(const Eigen::VectorXd& points);
  double Lean(const Eigen::VectorXd& points);
  template <class Visit>
  void ForEachMiddle(const Eigen::VectorXd& points, Visit visit);
  bool SolvePieces(const MultiStartSettings& attempts, Program& program, Eigen::VectorXd& points,
                   StretchSolution* solution);
  bool WillDo(const Eigen::VectorXd& points, StretchSolution* solution);
  int FirstPieces(const Stretch& start, const Eigen::VectorXd& ends);
  Eigen::VectorXd Divided(const Eigen::VectorXd& points, int pieces) const;
  Eigen::VectorXd PointsOf(const Stretch& stretch, int pieces) const;
  Stretch StretchOf(const Stretch& start, const Eigen::VectorXd& points) const;
  void LookAt(const Stretch& start);

  const Dataset* dataset_;
  CollisionQuery* query_;
  Solver* solver_;
  Task task_;
  ContactOptions contacts_;
  PathClearance clearance_;
  Kinematics kinematics_;
  Eigen::VectorXd x_;
  // Of the stretch at hand, by way.
  std::vector<Stance> planted_;
  std::vector<std::vector<Eigen::Vector2d>> polygons_;  ///< of the planted feet, where balance is asked for
  std::int64_t evaluations_ = 0;                        ///< of programs that are gone
  const Program* program_ = nullptr;                    ///< at hand
};

}  // namespace legopt

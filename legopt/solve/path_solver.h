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
#include "legopt/terms/waypoint_program.h"
#include "words/task.h"

namespace legopt {

/// From one waypoint of a motion to the next: what a continuous motion has between them.
struct Way {
  const Stance* from_stance = nullptr;    ///< of the first waypoint
  const Stance* to_stance = nullptr;      ///< of the second
  const Eigen::VectorXd* from = nullptr;  ///< the first waypoint, n + 7
  const Eigen::VectorXd* to = nullptr;    ///< the second
};

/// What became of it.
struct WaySolution {
  std::vector<Eigen::VectorXd> inner;                    ///< points between the waypoints, at equal distances in time
  bool feasible = false;                                 ///< by the solver's own measure
  SolveStatus status = SolveStatus::kConvergedFeasible;  ///< of the last solve; a stop, if there was one
  double max_violation = 0.0;                            ///< of the last program
  int restarts = 0;                                      ///< attempts beyond the first
  Effort effort;                                         ///< of all
  std::string message;                                   ///< of a failure: the largest violation
};

/// Leads motions from waypoint to waypoint: planted feet stay, nothing collides on the way, by Between::kBalanced the
/// centre of mass stays over the planted feet (docs/readings.md#continuous-motions). The waypoints do not move.
///
/// A straight way that will do is kept. Otherwise it is cut into so many pieces that planted feet, which leave their
/// targets by the square of a piece's length, stay near enough between them, and the program of its inner points
/// (MakePathProgram) is solved from the straight way by the method's own solver; when that is not feasible, planted
/// feet still drift too far or something collides between the points, from there with twice as many pieces, up to
/// kMostPieces.
///
/// A workspace; one thread.
class PathSolver {
 public:
  /// All must outlive it. `contacts` as for the motion's own programs.
  PathSolver(const Dataset& dataset, CollisionQuery& query, Solver& solver, Task task, const ContactOptions& contacts);

  /// `attempts` as for windows, but perturb and generator, which are of this program's points.
  WaySolution Solve(const Way& way, const std::function<MultiStartSettings()>& attempts);

  /// Term evaluations so far, those of a solve at hand included.
  std::int64_t Evaluations() const;

 private:
  bool IsFree(const Eigen::VectorXd& points);
  double Drift(const Stance& planted, const Eigen::VectorXd& points);
  bool SolvePieces(const MultiStartSettings& attempts, Program& program, Eigen::VectorXd& points,
                   WaySolution* solution);
  bool WillDo(const Stance& planted, const Eigen::VectorXd& points, WaySolution* solution);
  int FirstPieces(const Stance& planted, const Eigen::VectorXd& ends);
  Eigen::VectorXd Divided(const Eigen::VectorXd& points, int pieces) const;

  const Dataset* dataset_;
  CollisionQuery* query_;
  Solver* solver_;
  Task task_;
  ContactOptions contacts_;
  PathClearance clearance_;
  Kinematics kinematics_;
  Eigen::VectorXd x_;
  std::int64_t evaluations_ = 0;      ///< of programs that are gone
  const Program* program_ = nullptr;  ///< at hand
};

}  // namespace legopt

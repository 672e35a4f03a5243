#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

#include "legopt/problem/terms/swept_collision_term.h"
#include "legopt/problem/terms/waypoint_program.h"
#include "legopt/types/task.h"

namespace legopt {

/// Stances [first_stance, first_stance + num_stances) of a problem that are solved as one program.
struct StanceWindow {
  int first_stance = 0;  ///< index within the problem
  int num_stances = 0;   ///< >= 1
};

/// Returns the windows of a problem with `num_stances` >= 1 stances, in the order of solving. Posture: one stance per
/// window. Motion: 1 + ceil((N - 6) / 5) windows of six stances, of which the first is shared with the previous window
/// (docs/explanation/paper.md#motion-windows); the last window may be shorter.
std::vector<StanceWindow> StanceWindows(Task task, int num_stances);

/// Creates the program of one window: the constraints of every waypoint (waypoint_program.h), and the task's own terms:
///
///     posture: the torque cost; five terms in double support
///     motion:  the velocity cost as one sampling unit (docs/explanation/paper.md#terms-and-samples), continuous
///              collision between consecutive waypoints as set in `proximity`; 54 units in a full window
///
/// `stances` are those of the window. If `fixed_first`, the first waypoint does not move. Lifetimes as for
/// WaypointProgram.
std::unique_ptr<WaypointProgram> MakeTaskProgram(Task task, const Dataset& dataset, CollisionQuery& query,
                                                 std::span<const Stance> stances, const ProximityOptions& proximity,
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
                                                 bool balanced, const ProximityOptions& proximity, double step_m,
                                                 Sweep sweep);

/// Returns the optimiser's cost of a whole solution with `waypoints` (n + 7 each). `window_costs` is the sum of the
/// windows' costs, in which shared parts are counted twice.
double SolutionCost(Task task, const RobotModel& robot, std::span<const Eigen::VectorXd> waypoints,
                    double window_costs);

}  // namespace legopt

#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

#include "legopt/terms/swept_collision_term.h"
#include "legopt/terms/waypoint_program.h"
#include "words/task.h"

namespace legopt {

/// Stances [first_stance, first_stance + num_stances) of a problem, which are solved as one program.
struct StanceWindow {
  int first_stance = 0;  ///< index within the problem
  int num_stances = 0;   ///< >= 1
};

/// The windows of a problem with `num_stances` >= 1 stances, in the order of solving: a stance of its own each for a
/// posture; of a motion 1 + ceil((N - 6) / 5) of six stances, of which the first is shared with the window before
/// (docs/readings.md#motion-windows), the last one perhaps shorter.
std::vector<StanceWindow> StanceWindows(Task task, int num_stances);

/// The program of one window: the constraints of every waypoint (waypoint_program.h), and the task's own terms:
///
///     posture: the torque cost; five terms in double support
///     motion:  the velocity cost as one sampling unit (docs/readings.md#terms-and-samples), continuous collision
///              between consecutive waypoints as asked for; 54 units in a full window
///
/// `stances` are those of the window; with `fixed_first` its first waypoint does not move. Lifetimes as for
/// WaypointProgram.
std::unique_ptr<WaypointProgram> MakeTaskProgram(Task task, const Dataset& dataset, CollisionQuery& query,
                                                 std::span<const Stance> stances, const ContactOptions& contacts,
                                                 bool fixed_first = false);

/// Which ends of a stretch of a continuous motion move: those where the motion itself ends may.
struct PathEnds {
  bool first_moves = false;  ///< the stretch begins where the motion begins
  bool last_moves = false;   ///< it ends where the motion ends
};

/// The program of a stretch of a continuous motion, from waypoint to waypoint, each way cut into `pieces` of equal
/// time, >= 1. `stances` are those of its waypoints, two at least. Waypoints meet their own stances; a first or last
/// one that does not move has no terms. At the points of a way its planted feet (PlantedFeet) stay on their
/// targets, nothing collides there, nor between them (SweptCollisionTerm, an inequality, samples of `step_m`, of
/// `sweep`); if `balanced`, the centre of mass is over the planted feet. Its cost is the motion's, but for the factor
/// `pieces`. Lifetimes as above.
std::unique_ptr<WaypointProgram> MakePathProgram(const Dataset& dataset, CollisionQuery& query,
                                                 std::span<const Stance* const> stances, PathEnds ends, int pieces,
                                                 bool balanced, const ContactOptions& contacts, double step_m,
                                                 Sweep sweep);

/// Cost of a whole solution in the optimiser's terms, of `waypoints` (n + 7 each). `window_costs` is the sum of the
/// windows' own, which counts what they share twice.
double SolutionCost(Task task, const RobotModel& robot, std::span<const Eigen::VectorXd> waypoints,
                    double window_costs);

}  // namespace legopt

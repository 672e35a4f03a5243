#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "legopt/dataset/problem_definition.h"
#include "legopt/judge/internal/path_examiner.h"
#include "legopt/planning/internal/path_solver.h"
#include "legopt/robot/robot_model.h"

namespace legopt {

/// A segment between two waypoints on which the curve through the points of a motion breaks a rule.
struct CurveFault {
  int segment = 0;      ///< index of the waypoint at its start
  std::string message;  ///< the broken rule
};

/// Returns all segments on which the spline through the points of `path` (legopt/dynamics/path_spline.h) breaks a rule
/// of the solver between its points: planted feet, balance, collisions, joint limits. `stances`: one per waypoint.
std::vector<CurveFault> FindCurveFaults(const RobotModel& robot, PathSolver& paths, const TimedPath& path,
                                        std::span<const Stance* const> stances);

/// Moves the times of the points between the waypoints of one segment, so that a curve through them is slow at both
/// waypoints and overshoots less where the direction changes there. The point at the share f of the segment gets the
/// time t with f = h(t), where the cubic h has the slope kSlowStart at both ends (1: equal intervals in time).
void SlowDownAtWaypoints(std::size_t segment, TimedPath* path);
inline constexpr double kSlowStart = 0.1;

}  // namespace legopt

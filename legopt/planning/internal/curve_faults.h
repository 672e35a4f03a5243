#pragma once

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

}  // namespace legopt

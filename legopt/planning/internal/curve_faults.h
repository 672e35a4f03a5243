#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "legopt/dataset/problem_definition.h"
#include "legopt/judge/internal/path_examiner.h"
#include "legopt/planning/internal/path_solver.h"
#include "legopt/robot/robot_model.h"

namespace legopt {

/// A piece of a motion, from one point to the next, on which the curve through all points breaks a rule.
struct CurveFault {
  std::size_t piece = 0;    ///< index of the point at its start
  std::size_t segment = 0;  ///< index of the waypoint at or before that point
  std::string message;      ///< the broken rule
};

/// Returns all pieces on which the spline through the points of `path` (legopt/dynamics/path_spline.h) breaks a rule of
/// the solver: planted feet, balance, collisions, joint limits. In the order of time. `stances`: one per waypoint.
std::vector<CurveFault> FindCurveFaults(const RobotModel& robot, PathSolver& paths, const TimedPath& path,
                                        std::span<const Stance* const> stances);

/// Inserts `points` into the piece that starts at point `piece`, at equal intervals in time.
void InsertPoints(std::size_t piece, std::span<const Eigen::VectorXd> points, TimedPath* path);

}  // namespace legopt

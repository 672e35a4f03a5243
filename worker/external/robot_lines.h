#pragma once

#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <vector>

#include "legopt/problem/program.h"

/// @file
/// Robot data for external solvers in addition to the nonlinear program, if the program is that of a robot
/// (WaypointProgram).

namespace legopt::external {

/// Returns the pairs of bodies near or inside each other at the program's point, waypoint after waypoint
/// (docs/reference/external-solvers.md); an empty list if the program is not a robot's.
nlohmann::json ContactsJson(Program& program);

/// Returns the robot, the initial configurations `x` of a solve, and the targets of its feet
/// (docs/reference/external-solvers.md); null if the program is not a robot's.
nlohmann::json RobotJson(const Program& program, const Eigen::VectorXd& x);

/// Returns dx with Retract(x, dx) = `waypoints`. Throws SolverFault if their number or size differs from the program's,
/// a quaternion is zero, or the program is not a robot's.
Eigen::VectorXd TangentTo(const Program& program, const Eigen::VectorXd& x,
                          const std::vector<Eigen::VectorXd>& waypoints);

}  // namespace legopt::external

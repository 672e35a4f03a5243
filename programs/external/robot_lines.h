#pragma once

#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <vector>

#include "legopt/program/program.h"

/// @file
/// What a solver of others is told beyond the optimiser's view, where the program is that of a robot (WaypointProgram).

namespace legopt::external {

/// Pairs near each other or through each other at the program's point, waypoint after waypoint (docs/solvers.md); an
/// empty list where the program is not a robot's.
nlohmann::json ContactsJson(Program& program);

/// The robot, the configurations `x` that a solve starts from, and where its feet shall stand (docs/solvers.md); null
/// where the program is not a robot's.
nlohmann::json RobotJson(const Program& program, const Eigen::VectorXd& x);

/// dx with Retract(x, dx) = `waypoints`. Throws SolverFault where they are not as many, or not as long, as the
/// program's, a quaternion is zero, or the program is not a robot's.
Eigen::VectorXd WayTo(const Program& program, const Eigen::VectorXd& x, const std::vector<Eigen::VectorXd>& waypoints);

}  // namespace legopt::external

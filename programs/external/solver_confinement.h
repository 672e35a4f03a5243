#pragma once

#include <span>
#include <string>
#include <vector>

/// @file
/// The environment and the privileges of an external solver.

namespace legopt::external {

/// The environment of an external solver, NAME=value: variables of a short list (paths, language, Python, threads), and
/// those named in `further`. No variable of legopt: LEGOPT_KEY_FILE names the key of the deployment.
std::vector<std::string> SolverEnvironment(std::span<const std::string> further);

/// Whether a declaration may ask for a variable of this name: not for one of legopt.
bool MayPassOn(const std::string& name);

/// Confines the new process before it becomes the solver: no privileges through programs that it starts (no_new_privs)
/// and no capabilities but for files. Unless it needs the network, it gets a network namespace of its own where the
/// kernel allows that; loopback works there.
void ConfineSolver(bool needs_network);

/// Keeps other processes of this user, external solvers among them, from reading this one's memory, environment and
/// descriptors. Programs that it starts are not covered. Undone by no user namespace made later, which therefore has to
/// be made before.
void HideFromOtherProcesses();

}  // namespace legopt::external

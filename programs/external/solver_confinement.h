#pragma once

#include <span>
#include <string>
#include <vector>

/// @file
/// What an external solver is given of the process that starts it, and what is taken from it.

namespace legopt::external {

/// The environment of an external solver, NAME=value: variables of a short list (paths, language, Python, threads), and
/// those named in `further`. No variable of legopt: LEGOPT_KEY_FILE names the key of the deployment.
std::vector<std::string> SolverEnvironment(std::span<const std::string> further);

/// Whether a declaration may ask for a variable of this name: not for one of legopt.
bool MayPassOn(const std::string& name);

/// In the new process, before it becomes the solver: no privileges by its programs (no_new_privs), no capabilities but
/// for files, and, unless it needs the network and where the kernel allows it, a network namespace of its own, in which
/// loopback works.
void ConfineSolver(bool needs_network);

/// Keeps other processes of this user, external solvers among them, from reading this one's memory, environment and
/// descriptors. Programs that it starts are not covered. Undone by no user namespace made later, which therefore has to
/// be made before.
void HideFromOtherProcesses();

}  // namespace legopt::external

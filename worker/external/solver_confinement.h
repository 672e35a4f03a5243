#pragma once

#include <span>
#include <string>
#include <vector>

/// @file
/// Environment and privileges of an external solver.

namespace legopt::external {

/// Returns the environment of an external solver as NAME=value: a short list of variables (paths, language, Python,
/// threads), and those named in `further`. Excludes variables of legopt: LEGOPT_KEY_FILE names the key of the
/// deployment.
std::vector<std::string> SolverEnvironment(std::span<const std::string> further);

/// Returns whether a declaration may request a variable of this name. Variables of legopt are not permitted.
bool MayPassOn(const std::string& name);

/// Confines the new process before it becomes the solver: no privileges through programs that it starts (no_new_privs),
/// and no capabilities except for files. Unless it needs the network, it gets its own network namespace if the kernel
/// permits that; loopback works there.
void ConfineSolver(bool needs_network);

/// Prevents other processes of this user, including external solvers, from reading the memory, environment and
/// descriptors of this process. Does not cover its child programs. A user namespace must be created before, because a
/// hidden process cannot set one up.
void HideFromOtherProcesses();

}  // namespace legopt::external

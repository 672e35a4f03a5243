// Common parts of the scripts of all batch systems.
#pragma once

#include <string>
#include <vector>

#include "client/pool/pool_file.h"
#include "client/pool/pool_script.h"

namespace legopt::client {

/// Returns the worker's arguments except its name.
std::vector<std::string> WorkerArguments(const PoolFile& pool, const PoolAccess& access);

/// Returns the worker's command line for a shell. `name` is shell text that may be placed between double quotes.
std::string WorkerCommand(const PoolFile& pool, const PoolAccess& access, const std::string& name);

/// Returns a line that sets the worker's environment variables; empty if none are needed.
std::string Environment(const PoolAccess& access);

}  // namespace legopt::client

// What the scripts of all engines share.
#pragma once

#include <string>
#include <vector>

#include "client/pool/pool_file.h"
#include "client/pool/pool_script.h"

namespace legopt::client {

/// The worker's arguments but for its name.
std::vector<std::string> WorkerArguments(const PoolFile& pool, const PoolAccess& access);

/// The worker's command line, for a shell. `name` is shell text that may stand between double quotes.
std::string WorkerCommand(const PoolFile& pool, const PoolAccess& access, const std::string& name);

/// A line that sets what the worker needs of the environment; empty when that is nothing.
std::string Environment(const PoolAccess& access);

}  // namespace legopt::client

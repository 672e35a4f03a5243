#pragma once

#include <string>
#include <vector>

#include "client/pool/pool_file.h"

/// @file
/// The texts that engines are given. Pure functions.

namespace legopt::client {

/// How the workers of a pool find their server, and what they work with.
struct PoolAccess {
  std::string access_file;                     ///< path on the nodes; empty: `access` travels in the script
  std::string access;                          ///< content of an access file
  std::string key_file;                        ///< path on the nodes; empty: `key` travels in the script
  std::string key;                             ///< content of a worker's key file; empty, and no path: no key
  std::string program;                         ///< legopt-worker on the nodes
  std::string data_folder;                     ///< LEGOPT_DATA there; empty: what stands beside the program
  std::string logs;                            ///< folder that the engine's logs are written to
  std::string job_name;                        ///< for listings of the engine
  std::vector<std::string> datasets, solvers;  ///< folders and declarations on the nodes
};

/// A batch script for sbatch: an array of workers on one node each. The engine's signal comes `drain_s` and a minute
/// before the time limit, since Slurm may be that much early; then the worker drains and, where the pool file lets it,
/// the element is queued again. What travels in the script is never written on a node.
std::string SlurmScript(const PoolFile& pool, const PoolAccess& access);

/// A job script for qsub of PBS or Grid Engine, or a description for condor_submit. Throws InputError for an access
/// without paths: such scripts are stored as files that others may read.
std::string OtherEngineScript(Engine engine, const PoolFile& pool, const PoolAccess& access);

/// Lines for 'sh -s' on a host that ssh reaches: become a worker.
std::string HostScript(const PoolFile& pool, const PoolAccess& access, const std::string& host);

/// The content of a small file that travels in a script. Throws ClientError (kUsage) when it cannot be read.
std::string ReadWhole(const std::string& file);

/// The same text with the key, if it is there, replaced by a word: for people.
std::string WithoutKey(std::string script, const PoolAccess& access);

}  // namespace legopt::client

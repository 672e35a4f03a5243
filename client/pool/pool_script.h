#pragma once

#include <string>
#include <vector>

#include "client/pool/pool_file.h"

/// @file
/// Scripts for batch systems. Pure functions.

namespace legopt::client {

/// Server access, programs and datasets of the workers of a pool.
struct PoolAccess {
  std::string access_file;                     ///< path on the nodes; empty: `access` is embedded in the script
  std::string access;                          ///< contents of an access file
  std::string key_file;                        ///< path on the nodes; empty: `key` is embedded in the script
  std::string key;                             ///< contents of a worker's key file; empty, and no path: no key
  std::string program;                         ///< path of legopt-worker on the nodes
  std::string data_folder;                     ///< LEGOPT_DATA on the nodes; empty: the data folder beside the program
  std::string logs;                            ///< log folder
  std::string job_name;                        ///< job name in the batch system
  std::vector<std::string> datasets, solvers;  ///< dataset folders and solver description files on the nodes
};

/// Returns a batch script for sbatch: an array of workers with one node each. The signal is sent `drain_s` and a minute
/// before the time limit, because Slurm may send it up to a minute early. The worker then drains, and the element is
/// re-queued if the pool file allows it. Embedded files are never visible on a node's disk.
std::string SlurmScript(const PoolFile& pool, const PoolAccess& access);

/// Returns a job script for qsub of PBS or Grid Engine, or a description for condor_submit. Throws InputError for an
/// access without paths, because these scripts are stored as files that other users may read.
std::string OtherEngineScript(Engine engine, const PoolFile& pool, const PoolAccess& access);

/// Returns lines for 'sh -s' on a host reached by ssh that start a worker.
std::string HostScript(const PoolFile& pool, const PoolAccess& access, const std::string& host);

/// Returns the contents of a small file to be embedded in a script. Throws ClientError (kUsage) if it cannot be read.
std::string ReadWhole(const std::string& file);

/// Returns the script with the key, if any, replaced by a placeholder for display.
std::string WithoutKey(std::string script, const PoolAccess& access);

}  // namespace legopt::client

#pragma once

#include <string>
#include <vector>

#include "client/pool/pool_file.h"

namespace legopt::client {

/// @file
/// Scripts for batch systems. Pure functions.

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

// Common parts of the scripts of all batch systems.

/// Returns the worker's arguments except its name.
std::vector<std::string> WorkerArguments(const PoolFile& pool, const PoolAccess& access);

/// Returns the worker's command line for a shell. `name` is shell text that may be placed between double quotes.
std::string WorkerCommand(const PoolFile& pool, const PoolAccess& access, const std::string& name);

/// Returns a line that sets the worker's environment variables; empty if none are needed.
std::string EnvironmentLine(const PoolAccess& access);

// Quoting of values for batch scripts: one function per syntax, used for all values.

/// Refuses values that no script can contain: control characters (including line breaks) and, in the log folder,
/// characters that the batch system interprets. Throws InputError naming the field.
void CheckForScript(Engine engine, const PoolFile& pool, const PoolAccess& access);

/// Quotes a value as one word of an #SBATCH line: in single quotes if needed, with backslash escapes as in sbatch.
std::string SlurmWord(const std::string& value);

/// Escapes a literal path at the start of a pattern for --output.
std::string SlurmPatternOf(const std::string& path);

/// Quotes a value as one word of a #PBS or #$ line if needed. Throws InputError for a value that contains both kinds of
/// quotes or a backslash, because these lines have no escape character.
std::string QsubWord(const std::string& value);

/// Quotes a value as one word inside the double quotes of 'arguments' or 'environment' of condor_submit.
std::string CondorWord(const std::string& value);

/// Escapes a literal value after the '=' of a line for condor_submit.
std::string CondorValue(const std::string& value);

}  // namespace legopt::client

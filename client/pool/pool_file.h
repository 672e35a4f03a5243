#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "legopt/types/enum_names.h"

namespace legopt::client {

/// Software that starts workers on machines.
enum class Engine {
  kSlurm,
  kPbs,       ///< PBS Professional, OpenPBS
  kSge,       ///< Grid Engine
  kHtcondor,  ///< HTCondor
  kSsh,       ///< no batch system: hosts reachable by ssh
};

}  // namespace legopt::client

namespace legopt {
template <>
inline constexpr auto kEnumNames<client::Engine> = MakeEnumNames<client::Engine>({{client::Engine::kSlurm, "slurm"},
                                                                                  {client::Engine::kPbs, "pbs"},
                                                                                  {client::Engine::kSge, "sge"},
                                                                                  {client::Engine::kHtcondor,
                                                                                   "htcondor"},
                                                                                  {client::Engine::kSsh, "ssh"}});
}  // namespace legopt

namespace legopt::client {

/// An option that is passed to the batch system unchanged.
struct EngineOption {
  std::string key;                   ///< without dashes, e.g. "partition"
  std::optional<std::string> value;  ///< nullopt: an option without a value
  std::string place;                 ///< "pool.yaml:4", for error messages
};

/// Start options of each worker of a pool.
struct PoolWorker {
  std::optional<int> slots;           ///< nullopt: as many as granted processors
  int drain_s = 90;                   ///< time for running jobs to end when the batch system needs the machine, [0,
                                      ///< 86400]
  int idle_timeout_s = 300;           ///< idle time after which the worker exits, [1, 604800]
  int wait_server_s = 60;             ///< time without an answer of the server after which the worker exits, [1,
                                      ///< 604800]
  std::vector<std::string> datasets;  ///< folders on the nodes, or content hashes; empty: chosen by the command
  std::string key_file;               ///< path on the nodes; empty: the key is embedded in the script
  std::string program;                ///< path of legopt-worker on the nodes; empty: path of the local one
};

/// Contents of a pool file, for one batch system:
///
///     slurm:                     # pbs, sge, htcondor; or ssh, with `hosts: [a, b]` and options only
///       nodes: 4                 # number of workers, one per machine
///       at_once: 2               # maximum number that run at once (Slurm only; default: all)
///       exclusive: true          # whole machines
///       requeue: true            # restart preempted workers
///       partition: long          # any other key: an option of the batch system
///     worker: {slots: 8, drain_s: 90, idle_timeout_s: 300, wait_server_s: 60, dataset: DIR, key_file: FILE,
///              program: FILE}
///     server: {listen: 7669}     # for 'legopt run --slurm'; default: a free port
struct PoolFile {
  std::string file;                ///< file name as given by the user
  int nodes = 1;                   ///< [1, 100000]
  std::vector<std::string> hosts;  ///< ssh only, at least one; `nodes` is their number
  std::optional<int> at_once;
  bool exclusive = true;
  bool requeue = true;
  std::vector<EngineOption> options;  ///< ordered as in the file
  PoolWorker worker;
  std::string listen;  ///< listening port of legopt-server; empty: any free port

  /// Returns whether the user has set an option of the batch system.
  bool Sets(const std::string& key) const;
};

/// Reads the section of the batch system, `worker` and `server`. Throws InputError with file, line, key and remedy for
/// unknown legopt keys, values out of range, and options that legopt sets itself.
PoolFile ReadPoolFile(const std::string& file, Engine engine);

// The members of a pool, recorded in its folder: a file "jobs" with one line each, "slurm 17" for a Slurm array, "ssh
// 4711 123456" for a process of 'legopt pool ssh' and its start time, which distinguishes it from a later process with
// the same id.

/// A line of the record.
struct PoolMember {
  Engine engine;   ///< kSlurm or kSsh
  std::string id;  ///< "17", "4711 123456"
};

/// Appends a member. Throws ClientError (kUsage) if the file cannot be written.
void AddToRecord(const std::filesystem::path& folder, const PoolMember& member);

/// Returns the members in the order of addition. Throws ClientError (kUsage) if the file is missing or has other
/// contents.
std::vector<PoolMember> ReadRecord(const std::filesystem::path& folder);

}  // namespace legopt::client

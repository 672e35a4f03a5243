#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "words/words.h"

namespace legopt::client {

/// Who owns the machines on which workers are started.
enum class Engine {
  kSlurm,
  kPbs,       ///< PBS Professional, OpenPBS
  kSge,       ///< Grid Engine
  kHtcondor,  ///< HTCondor
  kSsh,       ///< nobody: hosts that ssh reaches
};

}  // namespace legopt::client

namespace legopt {
template <>
inline constexpr auto kWords<client::Engine> = Words<client::Engine>({{client::Engine::kSlurm, "slurm"},
                                                                      {client::Engine::kPbs, "pbs"},
                                                                      {client::Engine::kSge, "sge"},
                                                                      {client::Engine::kHtcondor, "htcondor"},
                                                                      {client::Engine::kSsh, "ssh"}});
}  // namespace legopt

namespace legopt::client {

/// An option that the engine is given as it stands in the file.
struct EngineOption {
  std::string key;                   ///< without dashes, e.g. "partition"
  std::optional<std::string> value;  ///< empty: a flag
  std::string place;                 ///< "pool.yaml:4", for messages
};

/// How each worker of a pool is started.
struct PoolWorker {
  std::optional<int> slots;           ///< empty: the processors that the engine grants
  int drain_s = 90;                   ///< for running jobs to end when the engine wants the machine back, [0, 86400]
  int idle_timeout_s = 300;           ///< without a job, after which it leaves, [1, 604800]
  int wait_server_s = 60;             ///< without an answer of the server, after which it gives up, [1, 604800]
  std::vector<std::string> datasets;  ///< folders on the nodes, or content hashes; empty: what the command says
  std::string key_file;               ///< on the nodes; empty: the key travels in the script
  std::string program;                ///< legopt-worker on the nodes; empty: where the one beside us is
};

/// The content of a pool file, for one engine:
///
///     slurm:                     # pbs, sge, htcondor; ssh has `hosts: [a, b]` in place of all but options
///       nodes: 4                 # workers, one to a machine
///       at_once: 2               # of them at most (Slurm only; default: all)
///       exclusive: true          # whole machines
///       requeue: true            # start again what the engine took the machine from
///       partition: long          # any other key: an option of the engine
///     worker: {slots: 8, drain_s: 90, idle_timeout_s: 300, wait_server_s: 60, dataset: DIR, key_file: FILE, program:
///     FILE} server: {listen: 7669}     # of 'legopt run --slurm'; default: a free port
struct PoolFile {
  std::string file;                ///< as it was named
  int nodes = 1;                   ///< [1, 100000]
  std::vector<std::string> hosts;  ///< of ssh only, at least one; then `nodes` is their number
  std::optional<int> at_once;
  bool exclusive = true;
  bool requeue = true;
  std::vector<EngineOption> options;  ///< in the order of the file
  PoolWorker worker;
  std::string listen;  ///< of legopt-server; empty: any free port

  /// Whether the user has set an option of the engine.
  bool Sets(const std::string& key) const;
};

/// Reads the engine's section, `worker` and `server`. Throws InputError naming file, line, key and fix: unknown keys of
/// ours, values out of range, and options of the engine that are ours to choose.
PoolFile ReadPoolFile(const std::string& file, Engine engine);

}  // namespace legopt::client

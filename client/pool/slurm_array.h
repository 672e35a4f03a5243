#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/pool/engine_call.h"
#include "client/pool/pool_file.h"

namespace legopt::client {

/// A worker's place in the queue, as Slurm tells.
struct SlurmElement {
  std::string id;        ///< "17_3"; of those that wait, perhaps "17_[2-3]"
  std::string state;     ///< "RUNNING", "PENDING", ...
  std::string place;     ///< node, or in parentheses why it waits
  std::string run_time;  ///< "1:05"
};

/// An array of workers. What Slurm says of it is for people, and a reason to look, never the truth about a worker: that
/// is the server's, by leases. Every command has a time-out. Thread rule: one thread.
class SlurmArray {
 public:
  /// Of a job that was submitted.
  explicit SlurmArray(std::string job_id) : job_id_(std::move(job_id)) {}

  /// Has sbatch take a script in. Throws ClientError: kMachine when there is no sbatch, kEngineRefused with Slurm's own
  /// words and, where they name one, the option of the pool file; also when it did not answer in time, then with what
  /// became of the job unknown.
  static SlurmArray Submit(const PoolFile& pool, const std::string& script);

  const std::string& job_id() const { return job_id_; }

  /// Asks Slurm when it is time to, without blocking, and returns what it said if that has just come; empty when there
  /// is no news or no answer.
  std::optional<std::vector<SlurmElement>> Look(std::chrono::steady_clock::time_point now);
  /// Asks now. Empty when Slurm does not answer.
  std::optional<std::vector<SlurmElement>> Elements() const;

  /// Those that wait are taken out of the queue; workers that run are told to stop, and have `patience` to finish their
  /// jobs, then a moment to give them back; then the array is cancelled. Returns before it is over when `give_up` says
  /// so, with the array cancelled. What Slurm does not answer is told on standard error.
  void Stop(std::chrono::milliseconds patience, bool (*give_up)() = nullptr);

 private:
  std::string job_id_;
  std::unique_ptr<EngineCall> look_;
  std::chrono::steady_clock::time_point next_look_{};
  std::chrono::seconds interval_{};  ///< between looks: grows
};

/// Lines of squeue, as SlurmArray asks for them.
std::vector<SlurmElement> ParseElements(const std::string& lines);

/// "2 running, 1 pending (Resources)"; "none" of none.
std::string Summary(const std::vector<SlurmElement>& elements);

}  // namespace legopt::client

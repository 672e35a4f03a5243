#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/pool/engine_call.h"
#include "client/pool/pool_file.h"

namespace legopt::client {

/// A worker's entry in the Slurm queue.
struct SlurmElement {
  std::string id;        ///< "17_3"; for pending elements possibly "17_[2-3]"
  std::string state;     ///< "RUNNING", "PENDING", ...
  std::string place;     ///< node, or the reason for pending in parentheses
  std::string run_time;  ///< "1:05"
};

/// An array of workers. Slurm's status is for display and triggers checks, but the state of the workers is determined
/// by the server's leases. Every command has a timeout. Thread rule: one thread.
class SlurmArray {
 public:
  /// Refers to a submitted job.
  explicit SlurmArray(std::string job_id) : job_id_(std::move(job_id)) {}

  /// Submits a script with sbatch. Throws ClientError: kMachine without sbatch; kEngineRefused with Slurm's message and
  /// the option of the pool file that it mentions, or if sbatch timed out (then it is unknown whether the job was
  /// accepted).
  static SlurmArray Submit(const PoolFile& pool, const std::string& script);

  const std::string& job_id() const { return job_id_; }

  /// Queries Slurm at intervals without blocking. Returns the elements when an answer has arrived; nullopt if there is
  /// no news or no answer.
  std::optional<std::vector<SlurmElement>> Look(std::chrono::steady_clock::time_point now);
  /// Queries Slurm now. Returns nullopt if Slurm does not answer.
  std::optional<std::vector<SlurmElement>> Elements() const;

  /// Removes pending elements from the queue and signals the running workers to stop: they have `patience` to finish
  /// their jobs, then a moment to release them; then the array is cancelled. If `give_up` returns true, cancels the
  /// array and returns early. Failed Slurm commands are reported on standard error.
  void Stop(std::chrono::milliseconds patience, bool (*give_up)() = nullptr);

 private:
  std::string job_id_;
  std::unique_ptr<EngineCommand> look_;
  std::chrono::steady_clock::time_point next_look_{};
  std::chrono::seconds interval_{};  ///< grows between queries
};

/// Parses the output of squeue in SlurmArray's format.
std::vector<SlurmElement> ParseElements(const std::string& lines);

/// Returns e.g. "2 running, 1 pending (Resources)"; "none" without elements.
std::string Summary(const std::vector<SlurmElement>& elements);

}  // namespace legopt::client

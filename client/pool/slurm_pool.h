#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/pool/engine_call.h"
#include "client/pool/pool_file.h"
#include "client/pool/pool_script.h"
#include "client/service/managed_pool.h"

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

/// Options of 'legopt run --slurm'.
struct SlurmPoolOptions {
  PoolFile file;
  std::filesystem::path database;
  std::filesystem::path dataset;
  NetworkOptions network;
  std::vector<std::filesystem::path> solvers = {};  ///< description files of external solvers, also on the nodes
  bool store_dataset = true;                        ///< store the dataset with the results
  bool verbose = false;                             ///< let the server write to this process's standard error
};

/// Returns the access of a pool whose workers use this command's programs and data at the same paths, with logs in
/// `folder`. Settings of the pool file have priority.
PoolAccess AccessWithLocalPaths(const PoolFile& file, const std::filesystem::path& folder);

/// Returns the folder with the logs, the key and the access file of a run's pool.
std::filesystem::path PoolFolder(const std::filesystem::path& database);

/// Returns the script of such a pool, as far as it is known before the server runs, with placeholders in parentheses
/// for its deployment, its addresses and the key.
std::string PreviewScript(const SlurmPoolOptions& options);

/// An ManagedPool with the server on this machine and workers in a Slurm array. The server uses an existing key
/// (LEGOPT_KEY_FILE) or creates one for this run; the worker's key is embedded in the script with all addresses of this
/// machine. The destructor cancels the array.
class SlurmPool final : public ManagedPool {
 public:
  /// Starts the server, then submits the array. Throws the errors of ManagedServer and SlurmArray::Submit.
  explicit SlurmPool(SlurmPoolOptions options);
  ~SlurmPool() override;

  const NetworkOptions& network() const override { return server_->network(); }
  /// Throws ClientError if the array has left Slurm's queue and no worker is connected, so that the remaining jobs
  /// would never run: kUnreachable if no worker ever reached the server, else kEngineRefused.
  void Supervise() override;
  void Stop(std::chrono::milliseconds patience) override;

 private:
  void PrepareFolder();
  /// Returns how workers refer to the dataset: by its content hash, to be fetched from the server, or by its path.
  std::string OfferDataset() const;
  void StartServer();
  void TakeNews(const std::vector<SlurmElement>& elements);
  void GiveUpWithoutWorkers();

  SlurmPoolOptions options_;
  std::filesystem::path folder_;
  PoolAccess access_;
  std::unique_ptr<ManagedServer> server_;
  std::optional<SlurmArray> array_;
  std::string last_summary_;
  int looks_without_elements_ = 0;
};

}  // namespace legopt::client

#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "client/pool/pool_file.h"
#include "client/pool/pool_script.h"
#include "client/pool/slurm_array.h"
#include "client/service/managed_pool.h"
#include "client/service/managed_server.h"

namespace legopt::client {

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

#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "client/pool/pool_file.h"
#include "client/pool/pool_script.h"
#include "client/pool/slurm_array.h"
#include "client/service/own_pool.h"
#include "client/service/own_server.h"

namespace legopt::client {

/// What 'legopt run --slurm' starts.
struct SlurmPoolOptions {
  PoolFile file;
  std::filesystem::path database;
  std::filesystem::path dataset;
  NetworkOptions network;
  std::vector<std::filesystem::path> solvers = {};  ///< declarations, on the nodes, too
  bool store_dataset = true;                        ///< the server stores the dataset with the results
  bool verbose = false;                             ///< let the server write to our standard error
};

/// The access of a pool whose workers are started like us: our programs and data at the same paths, logs in `folder`.
/// What the pool file says comes first.
PoolAccess AccessLikeOurs(const PoolFile& file, const std::filesystem::path& folder);

/// Where the logs, the key and the access file of a run's pool are.
std::filesystem::path PoolFolder(const std::filesystem::path& database);

/// The script of such a pool, as far as it is known before the server runs: words in parentheses stand for its
/// deployment, its addresses and the key.
std::string PreviewScript(const SlurmPoolOptions& options);

/// An OwnPool with the server on this machine and workers in an array of Slurm. The server listens for them, under a
/// key of this run unless there is one already (LEGOPT_KEY_FILE); the worker's key travels in the script with all
/// addresses of this machine. The destructor cancels the array.
class SlurmPool final : public OwnPool {
 public:
  /// Starts the server, then has Slurm take the array in. Throws as OwnServer and SlurmArray::Submit.
  explicit SlurmPool(SlurmPoolOptions options);
  ~SlurmPool() override;

  const NetworkOptions& network() const override { return server_->network(); }
  /// Throws ClientError when Slurm has none of the array any more and no worker is connected, as nobody would do what
  /// is left: kUnreachable when none ever found the server, else kEngineRefused.
  void Supervise() override;
  void Stop(std::chrono::milliseconds patience) override;

 private:
  void PrepareFolder();
  /// What workers are to name the dataset by: its content, for which they ask the server, or its path.
  std::string OfferDataset() const;
  void StartServer();
  void TakeNews(const std::vector<SlurmElement>& elements);
  void GiveUpWithoutWorkers();

  SlurmPoolOptions options_;
  std::filesystem::path folder_;
  PoolAccess access_;
  std::unique_ptr<OwnServer> server_;
  std::optional<SlurmArray> array_;
  std::string last_summary_;
  int looks_without_elements_ = 0;
};

}  // namespace legopt::client

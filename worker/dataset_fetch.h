#pragma once

#include <spdlog/logger.h>

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/exit_codes.h"
#include "app/stop_signals.h"
#include "legopt/types/read_guard.h"
#include "worker/pool.h"
#include "worker/server_link.h"

namespace legopt::worker {

/// Cache of datasets from the network, by content: FOLDER/HASH. Files may have changed because of a full disk or a
/// user's mistake, so content is hashed before each use. Several workers may use one folder concurrently. Thread rule:
/// one thread.
class DatasetCache {
 public:
  /// The folder is created when the first dataset is added. `guard` runs the readers that use third-party libraries.
  DatasetCache(std::filesystem::path folder, ReadGuard guard);

  /// Hashes the cached dataset and returns its folder; empty if there is none. Removes it if its content has another
  /// hash.
  std::optional<std::filesystem::path> Find(const std::string& hash) const;
  /// Unpacks an archive and returns its folder. Throws InputError and keeps no files if the archive cannot be unpacked
  /// or its content has another hash.
  std::filesystem::path Add(const std::string& hash, const std::string& archive) const;

 private:
  std::filesystem::path folder_;
  ReadGuard guard_;
};

/// Result of fetching a dataset.
struct FetchedDataset {
  enum class End {
    kFetched,
    kUnknown,      ///< the server does not offer it
    kUnreachable,  ///< no answer for too long
    kStopped,      ///< ordered to stop
  };
  End end = End::kUnreachable;
  std::string archive;  ///< set for kFetched: as received, unchecked
  std::string error;    ///< reason for the other ends, for humans
};

/// Options of FetchDataset.
struct DatasetFetchOptions {
  microseconds wait_server = microseconds::max();  ///< maximum time without an answer
  int stop_fd = -1;                                ///< readable if there may be an order to stop
  std::function<bool()> take_order = {};           ///< takes an order; false: there is none
  std::function<void(const std::string&)> tell = [](const std::string&) {};  ///< called once if the server is silent
};

/// Requests a dataset from the server piece by piece, and retries while the server does not answer (PROTOCOL.md,
/// section 9, Dataset). Blocks. Call on the link's thread.
FetchedDataset FetchDataset(ServerLink& link, const std::string& hash, const DatasetFetchOptions& options);

/// Signals and logger used by a search; both must outlive it.
struct DatasetSearchContext {
  app::StopSignals& stop;
  spdlog::logger& logger;
  std::string server_address;  ///< shown in messages
};

/// Result of searching a dataset in the cache and at the server.
struct FetchedFolder {
  FetchedDataset::End end = FetchedDataset::End::kUnreachable;  ///< kFetched also for a dataset from the cache
  std::filesystem::path folder;                                 ///< the dataset's folder if `end` is kFetched
  std::string error;                                            ///< reason of any other `end`
};

/// Returns the dataset with this content hash from the cache or else from the server, which may be silent for at most
/// `wait_server`. Prints the location of a dataset from the server. Throws InputError if the archive does not contain
/// this dataset or the cache cannot be written.
FetchedFolder FindOrFetch(const std::string& hash, const DatasetCache& cache, ServerLink& link,
                          microseconds wait_server, const DatasetSearchContext& around);

/// Replaces each content hash in `datasets` by the folder of an embedded dataset, a cached one, or one from the server,
/// in this order. If one is missing, logs the reason and returns the exit code: kUnreachable, kDatasetMismatch, or that
/// of an order to stop. Throws InputError if the server sends different content.
std::optional<ExitCode> FindDatasets(std::vector<std::filesystem::path>& datasets, const DatasetCache& cache,
                                     ServerLink& link, const PoolOptions& pool, const DatasetSearchContext& around);

/// Datasets of a worker that fetches those its jobs need: its own, and at most kMaxFetched fetched ones, of which the
/// oldest is dropped first. Clients choose the fetched ones, so none of them may end the worker: a dataset that cannot
/// be fetched or loaded is omitted. Thread rule: one thread.
class FetchedDatasets {
 public:
  static constexpr std::size_t kMaxFetched = 8;  ///< largest number of fetched datasets; every job process loads them
  static constexpr std::size_t kMaxUnfetched = 64;  ///< number of remembered failures

  /// `own`: folders that are never dropped. The cache must outlive this object.
  FetchedDatasets(std::vector<std::filesystem::path> own, const DatasetCache& cache);

  /// Folders of all datasets; the fetched ones are last.
  std::vector<std::filesystem::path> folders() const;
  /// Content hashes of datasets that could not be fetched or loaded; at most kMaxUnfetched, the oldest is dropped
  /// first.
  const std::vector<std::string>& unfetched() const { return unfetched_; }

  /// Gets the dataset from the cache or else from the server, and logs failures. Returns false after an order to stop.
  /// If the server is silent for a minute, nothing changes.
  bool Fetch(const std::string& hash, ServerLink& link, const PoolOptions& pool, const DatasetSearchContext& around);
  /// Drops the dataset that was fetched last, after job processes could not load it. Returns false if there is none.
  bool DropLast(spdlog::logger& logger);

 private:
  struct Fetched {
    std::string hash;
    std::filesystem::path folder;
  };
  void NoteFailure(const std::string& hash);

  std::vector<std::filesystem::path> own_;
  const DatasetCache& cache_;
  std::vector<Fetched> fetched_;
  std::vector<std::string> unfetched_;
};

}  // namespace legopt::worker

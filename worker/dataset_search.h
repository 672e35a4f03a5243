#pragma once

#include <spdlog/logger.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/exit_codes.h"
#include "app/stop_signals.h"
#include "worker/dataset_cache.h"
#include "worker/dataset_fetch.h"
#include "worker/pool.h"
#include "worker/server_link.h"

namespace legopt::worker {

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

}  // namespace legopt::worker

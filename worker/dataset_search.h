#pragma once

#include <spdlog/logger.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "programs/exit_codes.h"
#include "programs/stop_signals.h"
#include "worker/dataset_cache.h"
#include "worker/dataset_fetch.h"
#include "worker/pool.h"
#include "worker/server_link.h"

namespace legopt::worker {

/// Whom a search listens to and speaks to; both outlive it.
struct SearchSurroundings {
  programs::StopSignals& stop;
  spdlog::logger& logger;
  std::string server_address;  ///< shown in messages
};

/// A dataset that was looked for in the cache and at the server.
struct FetchedFolder {
  FetchedDataset::End end = FetchedDataset::End::kUnreachable;  ///< kFetched also for one from the cache
  std::filesystem::path folder;                                 ///< the dataset's folder if `end` is kFetched
  std::string error;                                            ///< reason of any other `end`
};

/// The dataset with this content hash, from the cache, else from the server, whose silence it endures for
/// `wait_server`. Prints where a dataset from the server was put. Throws InputError for an archive that is no such
/// dataset and for a cache that cannot be written.
FetchedFolder FindOrFetch(const std::string& hash, const DatasetCache& cache, ServerLink& link,
                          microseconds wait_server, const SearchSurroundings& around);

/// Puts a folder in the place of each content hash among `datasets`: an embedded dataset, the cache's, or what the
/// server hands out, in this order. How the worker ends when one cannot be had, with the reason logged: kUnreachable,
/// kDatasetMismatch, or what a stop means. Throws InputError for what the server gives when that is something else.
std::optional<ExitCode> FindDatasets(std::vector<std::filesystem::path>& datasets, const DatasetCache& cache,
                                     ServerLink& link, const PoolOptions& pool, const SearchSurroundings& around);

}  // namespace legopt::worker

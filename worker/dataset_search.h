#pragma once

#include <spdlog/logger.h>

#include <filesystem>
#include <optional>
#include <vector>

#include "programs/exit_codes.h"
#include "programs/stop_signals.h"
#include "worker/dataset_cache.h"
#include "worker/pool.h"
#include "worker/server_link.h"

namespace legopt::worker {

/// Whom a search listens to and speaks to; both outlive it.
struct SearchSurroundings {
  programs::StopSignals& stop;
  spdlog::logger& logger;
};

/// Puts a folder in the place of each content hash among `datasets`: an embedded dataset, the cache's, or what the
/// server hands out, in this order. How the worker ends when one cannot be had, with the reason logged: kUnreachable,
/// kDatasetMismatch, or what a stop means. Throws InputError for what the server gives when that is something else.
std::optional<ExitCode> FindDatasets(std::vector<std::filesystem::path>& datasets, const DatasetCache& cache,
                                     ServerLink& link, const PoolOptions& pool, const SearchSurroundings& around);

}  // namespace legopt::worker

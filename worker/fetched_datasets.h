#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "worker/dataset_cache.h"
#include "worker/dataset_search.h"
#include "worker/pool.h"
#include "worker/server_link.h"

namespace legopt::worker {

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

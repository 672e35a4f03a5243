#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "worker/dataset_cache.h"
#include "worker/dataset_search.h"
#include "worker/pool.h"
#include "worker/server_link.h"

namespace legopt::worker {

/// The datasets of a worker that fetches those its jobs need: what it has from the start, and at most kMostFetched
/// more, of which the one fetched first makes room. Clients decide what is fetched, so none of it may end the worker: a
/// dataset that cannot be fetched or loaded is left out. Thread rule: one thread.
class FetchedDatasets {
 public:
  static constexpr std::size_t kMostFetched = 8;     ///< at the same time; every job process loads them
  static constexpr std::size_t kMostUnfetched = 64;  ///< number of remembered failures

  /// `own`: folders that stay. The cache must outlive this object.
  FetchedDatasets(std::vector<std::filesystem::path> own, const DatasetCache& cache);

  /// Folders of all datasets, those fetched last.
  std::vector<std::filesystem::path> folders() const;
  /// Content hashes of datasets that could not be fetched or loaded; at most kMostUnfetched, the oldest is dropped.
  const std::vector<std::string>& unfetched() const { return unfetched_; }

  /// Gets the dataset from the cache or else from the server, and logs what goes wrong. False when the worker was told
  /// to stop. A server that is silent for a minute changes nothing.
  bool Fetch(const std::string& hash, ServerLink& link, const PoolOptions& pool, const SearchSurroundings& around);
  /// Leaves the dataset out that was fetched last, after job processes could not load it. False when there is none.
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

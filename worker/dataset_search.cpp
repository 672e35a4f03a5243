#include "worker/dataset_search.h"

#include <cstdio>
#include <string>

#include "legopt/dataset/dataset_archive.h"
#include "legopt/input_error.h"
#include "programs/data_folder.h"
#include "programs/isolated_call.h"
#include "programs/printable.h"
#include "worker/dataset_fetch.h"

namespace legopt::worker {
namespace {

namespace fs = std::filesystem;

std::optional<fs::path> FindEmbedded(const std::string& hash) {
  try {
    for (const fs::path& folder : programs::EmbeddedDatasetFolders()) {
      if (HashOfDataset(folder, CallIsolated) == hash) return folder;
    }
  } catch (const InputError&) {  // a program that was installed without data
  }
  return std::nullopt;
}

ExitCode EndOf(const FetchedDataset& fetched, const PoolOptions& pool, spdlog::logger& logger) {
  switch (fetched.end) {
    case FetchedDataset::End::kUnknown:
      logger.error(fetched.error);
      return ExitCode::kDatasetMismatch;
    case FetchedDataset::End::kUnreachable:
      logger.error("no answer from a server at {}: {}", pool.server_address, fetched.error);
      return ExitCode::kUnreachable;
    case FetchedDataset::End::kFetched:
    case FetchedDataset::End::kStopped:
      break;
  }
  return ExitCode::kOk;
}

}  // namespace

std::optional<ExitCode> FindDatasets(std::vector<fs::path>& datasets, const DatasetCache& cache, ServerLink& link,
                                     const PoolOptions& pool, const SearchSurroundings& around) {
  DatasetFetchOptions options;
  options.wait_server = pool.wait_server;
  options.stop_fd = around.stop.descriptor();
  options.take_order = [&around] { return around.stop.Take(); };
  options.tell = [&](const std::string& error) {
    around.logger.warn("no answer from a server at {} yet: {}", pool.server_address, error);
  };
  for (fs::path& dataset : datasets) {
    const std::string hash = dataset.string();
    if (!IsDatasetHash(hash)) continue;
    std::optional<fs::path> folder = FindEmbedded(hash);
    if (!folder) folder = cache.Find(hash);
    if (!folder) {
      const FetchedDataset fetched = FetchDataset(link, hash, options);
      if (fetched.end != FetchedDataset::End::kFetched) return EndOf(fetched, pool, around.logger);
      folder = cache.Add(hash, fetched.archive);
      std::printf("legopt-worker: dataset %s came from the server: %zu bytes, now in %s\n", hash.c_str(),
                  fetched.archive.size(), programs::Printable(folder->string()).c_str());
      std::fflush(stdout);
    }
    dataset = *folder;
  }
  return std::nullopt;
}

}  // namespace legopt::worker

#include "worker/dataset_search.h"

#include <cstdio>
#include <string>

#include "app/data_folder.h"
#include "app/dataset_cache_folder.h"
#include "app/isolated_call.h"
#include "app/printable.h"
#include "legopt/dataset/dataset_archive.h"
#include "legopt/types/input_error.h"

namespace legopt::worker {
namespace {

namespace fs = std::filesystem;

std::optional<fs::path> FindEmbedded(const std::string& hash) {
  try {
    for (const fs::path& folder : app::EmbeddedDatasetFolders()) {
      if (HashOfDataset(folder, CallIsolated) == hash) return folder;
    }
  } catch (const InputError&) {  // the program was installed without data
  }
  return std::nullopt;
}

ExitCode EndOf(const FetchedFolder& found, const DatasetSearchContext& around) {
  switch (found.end) {
    case FetchedDataset::End::kUnknown:
      around.logger.error(found.error);
      return ExitCode::kDatasetMismatch;
    case FetchedDataset::End::kUnreachable:
      around.logger.error("no answer from a server at {}: {}", around.server_address, found.error);
      return ExitCode::kUnreachable;
    case FetchedDataset::End::kFetched:
    case FetchedDataset::End::kStopped:
      break;
  }
  return ExitCode::kOk;
}

}  // namespace

FetchedFolder FindOrFetch(const std::string& hash, const DatasetCache& cache, ServerLink& link,
                          microseconds wait_server, const DatasetSearchContext& around) {
  if (const auto folder = cache.Find(hash)) return {FetchedDataset::End::kFetched, *folder, {}};
  DatasetFetchOptions options;
  options.wait_server = wait_server;
  options.stop_fd = around.stop.descriptor();
  options.take_order = [&around] { return around.stop.Take(); };
  options.tell = [&](const std::string& error) {
    around.logger.warn("no answer from a server at {} yet: {}", around.server_address, error);
  };
  const FetchedDataset fetched = FetchDataset(link, hash, options);
  if (fetched.end != FetchedDataset::End::kFetched) return {fetched.end, {}, fetched.error};
  const fs::path folder = cache.Add(hash, fetched.archive);
  std::printf("legopt-worker: dataset %s came from the server: %zu bytes, now in %s\n", hash.c_str(),
              fetched.archive.size(), app::Printable(folder.string()).c_str());
  std::fflush(stdout);
  return {FetchedDataset::End::kFetched, folder, {}};
}

std::optional<ExitCode> FindDatasets(std::vector<fs::path>& datasets, const DatasetCache& cache, ServerLink& link,
                                     const PoolOptions& pool, const DatasetSearchContext& around) {
  for (fs::path& dataset : datasets) {
    const std::string hash = dataset.string();
    if (!app::IsDatasetHash(hash)) continue;
    if (const auto embedded = FindEmbedded(hash)) {
      dataset = *embedded;
      continue;
    }
    const FetchedFolder found = FindOrFetch(hash, cache, link, pool.wait_server, around);
    if (found.end != FetchedDataset::End::kFetched) return EndOf(found, around);
    dataset = found.folder;
  }
  return std::nullopt;
}

}  // namespace legopt::worker

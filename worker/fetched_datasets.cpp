#include "worker/fetched_datasets.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>

#include "legopt/types/input_error.h"
#include "worker/dataset_fetch.h"

namespace legopt::worker {
namespace {

namespace fs = std::filesystem;

constexpr microseconds kFetchPatience = std::chrono::seconds(60);

}  // namespace

FetchedDatasets::FetchedDatasets(std::vector<fs::path> own, const DatasetCache& cache)
    : own_(std::move(own)), cache_(cache) {}

std::vector<fs::path> FetchedDatasets::folders() const {
  std::vector<fs::path> folders = own_;
  for (const Fetched& fetched : fetched_) folders.push_back(fetched.folder);
  return folders;
}

void FetchedDatasets::NoteFailure(const std::string& hash) {
  unfetched_.push_back(hash);
  if (unfetched_.size() > kMaxUnfetched) unfetched_.erase(unfetched_.begin());
}

bool FetchedDatasets::DropLast(spdlog::logger& logger) {
  if (fetched_.empty()) return false;
  logger.warn("dataset {} cannot be loaded; the worker continues without it", fetched_.back().hash);
  NoteFailure(fetched_.back().hash);
  fetched_.pop_back();
  return true;
}

bool FetchedDatasets::Fetch(const std::string& hash, ServerLink& link, const PoolOptions& pool,
                            const DatasetSearchContext& around) {
  const auto is_it = [&](const Fetched& fetched) { return fetched.hash == hash; };
  if (std::any_of(fetched_.begin(), fetched_.end(), is_it)) {
    around.logger.warn("dataset {} was fetched, but the job processes have not loaded it", hash);
    std::erase_if(fetched_, is_it);
    NoteFailure(hash);
    return true;
  }
  try {
    const FetchedFolder found = FindOrFetch(hash, cache_, link, std::min(pool.wait_server, kFetchPatience), around);
    if (found.end == FetchedDataset::End::kStopped) return false;
    if (found.end == FetchedDataset::End::kFetched) {
      if (fetched_.size() == kMaxFetched) fetched_.erase(fetched_.begin());
      fetched_.push_back({hash, found.folder});
      return true;
    }
    around.logger.warn("dataset {} could not be fetched: {}", hash, found.error);
    if (found.end == FetchedDataset::End::kUnknown) NoteFailure(hash);
  } catch (const InputError& error) {
    around.logger.warn("dataset {} could not be fetched: {}", hash, error.what());
    NoteFailure(hash);
  }
  return true;
}

}  // namespace legopt::worker

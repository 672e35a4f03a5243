#include "client/archive/archive_dataset.h"

#include "client/client_error.h"
#include "client/report/result_dataset.h"

namespace legopt::client {
namespace {

constexpr std::size_t kShownHash = 12;

std::string NameWithHash(const std::string& name, const std::string& hash) {
  return name + " (" + hash.substr(0, kShownHash) + ")";
}

}  // namespace

std::shared_ptr<const Dataset> FindArchivedDataset(const Archive& archive,
                                                   const std::vector<std::shared_ptr<const Dataset>>& datasets,
                                                   DatasetUse use) {
  const std::string wanted = "the archive's dataset " + NameWithHash(archive.dataset, archive.dataset_hash);
  std::string given;
  for (const auto& dataset : datasets) {
    if (dataset->content_hash() == archive.dataset_hash) return dataset;
    given += (given.empty() ? "" : ", ") + NameWithHash(dataset->name(), dataset->content_hash());
  }
  if (use == DatasetUse::kOnlyGiven && !given.empty()) {
    throw ClientError(ExitCode::kDatasetMismatch, wanted + " is not the one of --dataset: " + given);
  }
  if (auto dataset = FindLocalDataset(archive.dataset_hash)) return dataset;
  throw ClientError(ExitCode::kDatasetMismatch, wanted + " is not on this machine; give --dataset FOLDER");
}

}  // namespace legopt::client

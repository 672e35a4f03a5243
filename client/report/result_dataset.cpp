#include "client/report/result_dataset.h"

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <optional>
#include <system_error>
#include <utility>

#include "app/data_folder.h"
#include "app/folder_cache.h"
#include "app/printable.h"
#include "db/named_queries.h"
#include "legopt/dataset/internal/dataset_content.h"
#include "legopt/files/temporary_folder.h"
#include "legopt/types/input_error.h"

namespace legopt::client {
namespace {

namespace fs = std::filesystem;

fs::path LinkOf(const std::string& hash) { return app::DatasetCacheFolder().parent_path() / "submitted" / hash; }

bool IsEmbedded(const fs::path& folder) {
  std::error_code ignored;
  return std::ranges::any_of(app::EmbeddedDatasetFolders(),
                             [&](const fs::path& embedded) { return fs::equivalent(embedded, folder, ignored); });
}

}  // namespace

void RecordDatasetFolder(const std::string& hash, const fs::path& folder) {
  if (!app::IsDatasetHash(hash) || IsEmbedded(folder)) return;
  std::error_code error;
  const fs::path link = LinkOf(hash);
  if (fs::read_symlink(link, error) == folder) return;
  fs::create_directories(link.parent_path(), error);
  // Create the link under a temporary name first, so that other processes never find it missing.
  const fs::path fresh = link.string() + "." + std::to_string(::getpid());
  fs::create_symlink(folder, fresh, error);
  if (!error) fs::rename(fresh, link, error);
  if (error) fs::remove(fresh, error);
}

std::optional<fs::path> RecordedDatasetFolder(const std::string& hash) {
  if (!app::IsDatasetHash(hash)) return std::nullopt;
  std::error_code error;
  const fs::path folder = fs::read_symlink(LinkOf(hash), error);
  if (error || !fs::is_directory(folder, error)) return std::nullopt;
  return folder;
}

namespace {

// A stored dataset and the temporary folder that contains its meshes.
class UnpackedDataset {
 public:
  explicit UnpackedDataset(const std::string& archive) : folder_(files::CreateTemporaryFolder("legopt-dataset-")) {
    try {
      UnpackDataset(archive, folder_, GuardedReader());
      dataset_ = Dataset::Load(folder_, GuardedReader());
    } catch (...) {
      Remove();
      throw;
    }
  }
  ~UnpackedDataset() { Remove(); }
  UnpackedDataset(const UnpackedDataset&) = delete;
  UnpackedDataset& operator=(const UnpackedDataset&) = delete;
  const Dataset& dataset() const { return *dataset_; }

 private:
  void Remove() {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  fs::path folder_;
  std::shared_ptr<const Dataset> dataset_;
};

std::shared_ptr<const Dataset> FindEmbedded(const std::string& hash) {
  for (const fs::path& folder : app::EmbeddedDatasetFolders()) {
    if (HashOfDataset(folder, GuardedReader()) == hash) return Dataset::Load(folder, GuardedReader());
  }
  return nullptr;
}

// Returns nullptr if the folder does not contain a dataset, or one with other content.
std::shared_ptr<const Dataset> LoadIfContent(const fs::path& folder, const std::string& hash) {
  try {
    auto dataset = Dataset::Load(folder, GuardedReader());
    return dataset->content_hash() == hash ? dataset : nullptr;
  } catch (const InputError&) {
    return nullptr;
  }
}

// Returns a dataset fetched by a worker of this user. A damaged one is not removed: the worker replaces it.
std::shared_ptr<const Dataset> FindCached(const std::string& hash) {
  std::error_code ignored;
  const fs::path folder = app::DatasetCacheFolder() / hash;
  if (!app::IsDatasetHash(hash) || !fs::is_directory(folder, ignored)) return nullptr;
  return LoadIfContent(folder, hash);
}

std::shared_ptr<const Dataset> FindSubmitted(const std::string& hash) {
  const auto folder = RecordedDatasetFolder(hash);
  return folder ? LoadIfContent(*folder, hash) : nullptr;
}

// The sender of the archive may have sent other content, so it is hashed.
std::shared_ptr<const Dataset> FindStored(ResultSource& source, const std::string& hash) {
  const Listing found = source.Query(db::Sql(db::Query::kDatasetArchive, {{"hash", hash}}));
  if (found.rows.empty()) return nullptr;
  const std::optional<std::string> archive = BlobAt(found, 0, "archive");
  if (!archive) return nullptr;
  std::string fault;
  try {
    auto unpacked = std::make_shared<const UnpackedDataset>(*archive);
    const std::string& content = unpacked->dataset().content_hash();
    if (content == hash) return {unpacked, &unpacked->dataset()};
    fault = "its content is dataset " + content;
  } catch (const InputError& error) {
    fault = error.what();
  }
  std::cerr << "legopt: warning: the archive of dataset " << hash
            << " that is stored with the results is not used: " << app::Printable(fault) << "\n";
  return nullptr;
}

}  // namespace

std::shared_ptr<const Dataset> FindResultDataset(ResultSource& source, const std::string& hash) {
  if (auto embedded = FindEmbedded(hash)) return embedded;
  if (auto cached = FindCached(hash)) return cached;
  if (auto stored = FindStored(source, hash)) return stored;
  return FindSubmitted(hash);
}

}  // namespace legopt::client

#include "client/report/result_dataset.h"

#include <unistd.h>

#include <algorithm>
#include <climits>
#include <filesystem>
#include <iostream>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

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

// Returns `name` if it is the name of one folder entry, else another one.
std::string FolderName(const std::string& name) {
  const bool plain = !name.empty() && name != "." && name != ".." && name.size() <= NAME_MAX &&
                     name.find_first_of(std::string_view("/\0", 2)) == std::string::npos;
  return plain ? name : "dataset";
}

// A stored dataset and the temporary folder that contains its meshes. A folder in LegOpt's format has the name of the
// dataset, because it is not stated elsewhere.
class UnpackedDataset {
 public:
  UnpackedDataset(const std::string& archive, const std::string& dataset_name)
      : folder_(files::CreateTemporaryFolder("legopt-dataset-")) {
    try {
      const fs::path inner = folder_ / FolderName(dataset_name);
      fs::create_directory(inner);
      UnpackDataset(archive, inner, GuardedReader());
      dataset_ = Dataset::Load(inner, GuardedReader());
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

// Folders of datasets in the data folder; traps lie in the folder of another dataset.
std::vector<fs::path> FoldersInDataFolder() {
  constexpr int kDeepest = 2;
  std::vector<fs::path> folders;
  std::error_code error;
  fs::recursive_directory_iterator entry(app::DataFolder(), fs::directory_options::skip_permission_denied, error);
  for (; !error && entry != fs::end(entry); entry.increment(error)) {
    if (entry.depth() >= kDeepest) entry.disable_recursion_pending();
    if (entry->path().filename() == "dataset.yaml") folders.push_back(entry->path().parent_path());
  }
  return folders;
}

// Content hashes of all datasets in the data folder, also of those that no experiment uses by default. Hashing them
// takes a second, once in a process.
const std::map<std::string, fs::path>& DatasetsOfDataFolder() {
  static const std::map<std::string, fs::path> datasets = [] {
    std::map<std::string, fs::path> found;
    for (const fs::path& folder : FoldersInDataFolder()) {
      try {
        found.emplace(HashOfDataset(folder, GuardedReader()), folder);
      } catch (const std::exception&) {  // a damaged one in a user's data folder is not the one that is searched
      }
    }
    return found;
  }();
  return datasets;
}

std::shared_ptr<const Dataset> FindInDataFolder(const std::string& hash) {
  const auto found = DatasetsOfDataFolder().find(hash);
  return found == DatasetsOfDataFolder().end() ? nullptr : Dataset::Load(found->second, GuardedReader());
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

// A folder in LegOpt's format is the only statement of the dataset's name; in the cache it is called by the hash.
bool StatesItsName(const Dataset& dataset) {
  std::error_code ignored;
  return fs::is_regular_file(dataset.folder() / "dataset.yaml", ignored);
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
  const std::string name = found.At(0, "name").is_string() ? found.At(0, "name").get<std::string>() : "";
  std::string fault;
  try {
    auto unpacked = std::make_shared<const UnpackedDataset>(*archive, name);
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

std::shared_ptr<const Dataset> FindLocalDataset(const std::string& hash) {
  if (auto embedded = FindEmbedded(hash)) return embedded;
  if (auto submitted = FindSubmitted(hash)) return submitted;
  if (auto cached = FindCached(hash)) return cached;
  return FindInDataFolder(hash);
}

std::shared_ptr<const Dataset> FindResultDataset(ResultSource& source, const std::string& hash) {
  if (auto embedded = FindEmbedded(hash)) return embedded;
  const auto cached = FindCached(hash);
  if (cached && StatesItsName(*cached)) return cached;
  if (auto stored = FindStored(source, hash)) return stored;
  if (auto submitted = FindSubmitted(hash)) return submitted;
  return cached;
}

}  // namespace legopt::client

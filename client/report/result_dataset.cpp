#include "client/report/result_dataset.h"

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>

#include "client/client_error.h"
#include "legopt/dataset/dataset_archive.h"
#include "programs/data_folder.h"
#include "programs/isolated_call.h"

namespace legopt::client {
namespace {

namespace fs = std::filesystem;

// A stored dataset with the folder that its meshes are read from.
class UnpackedDataset {
 public:
  explicit UnpackedDataset(const std::string& archive) {
    std::string name = (fs::temp_directory_path() / "legopt-dataset-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) {
      throw ClientError(ExitCode::kUsage, name + ": cannot be created: " + std::generic_category().message(errno) +
                                              "; set TMPDIR to a folder with room");
    }
    folder_ = name;
    try {
      UnpackDataset(archive, folder_, CallIsolated);
      dataset_ = Dataset::Load(folder_, CallIsolated);
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
  for (const fs::path& folder : programs::EmbeddedDatasetFolders()) {
    if (HashOfDataset(folder, CallIsolated) == hash) return Dataset::Load(folder, CallIsolated);
  }
  return nullptr;
}

}  // namespace

std::shared_ptr<const Dataset> FindResultDataset(ResultSource& source, const std::string& hash) {
  if (auto embedded = FindEmbedded(hash)) return embedded;
  const Listing found = source.Query(
      "SELECT archive FROM dataset_archives JOIN datasets USING (dataset_id) WHERE hash = " + SqlText(hash));
  if (found.rows.empty()) return nullptr;
  const std::optional<std::string> archive = BlobAt(found, 0, "archive");
  if (!archive) return nullptr;
  auto unpacked = std::make_shared<const UnpackedDataset>(*archive);
  if (unpacked->dataset().content_hash() != hash) return nullptr;  // altered: of another dataset
  return {unpacked, &unpacked->dataset()};
}

}  // namespace legopt::client

#include "client/report/submitted_datasets.h"

#include <unistd.h>

#include <algorithm>
#include <system_error>

#include "app/data_folder.h"
#include "app/dataset_cache_folder.h"

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

}  // namespace legopt::client

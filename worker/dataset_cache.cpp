#include "worker/dataset_cache.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <system_error>
#include <utility>

#include "legopt/dataset/dataset_archive.h"
#include "legopt/types/input_error.h"

namespace legopt::worker {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void Refuse(const fs::path& folder, const std::string& message, const std::string& fix) {
  throw InputError({folder.string(), "", "", message, fix});
}

// Creates a folder that only this user can write to. In the folder for temporary files another user may already have
// created it.
void CreatePrivateFolder(const fs::path& folder) {
  const std::string fix = "set XDG_CACHE_HOME to a folder of your own with free space";
  std::error_code error;
  fs::create_directories(folder, error);
  struct stat status {};
  if (error || stat(folder.c_str(), &status) != 0) Refuse(folder, "cannot be made: " + error.message(), fix);
  if (status.st_uid != geteuid()) Refuse(folder, "belongs to another user", fix);
  chmod(folder.c_str(), S_IRWXU);
}

// Folder for unpacking. The destructor removes it with its content unless it has been moved.
class UnpackFolder {
 public:
  explicit UnpackFolder(const fs::path& cache) {
    std::string name = (cache / ".unpacking-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) {
      Refuse(cache, std::string("cannot be written: ") + std::strerror(errno), "set XDG_CACHE_HOME to another folder");
    }
    path_ = name;
  }
  ~UnpackFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  UnpackFolder(const UnpackFolder&) = delete;
  UnpackFolder& operator=(const UnpackFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

}  // namespace

DatasetCache::DatasetCache(fs::path folder, ReadGuard guard) : folder_(std::move(folder)), guard_(std::move(guard)) {}

std::optional<fs::path> DatasetCache::Find(const std::string& hash) const {
  const fs::path folder = folder_ / hash;
  if (!fs::exists(folder)) return std::nullopt;
  try {
    if (HashOfDataset(folder, guard_) == hash) return folder;
  } catch (const InputError&) {  // no longer a dataset: treated like different content
  }
  std::error_code ignored;
  fs::remove_all(folder, ignored);
  return std::nullopt;
}

fs::path DatasetCache::Add(const std::string& hash, const std::string& archive) const {
  CreatePrivateFolder(folder_);
  const UnpackFolder unpacked(folder_);
  UnpackDataset(archive, unpacked.path(), guard_);
  if (const std::string found = HashOfDataset(unpacked.path(), guard_); found != hash) {
    throw InputError({"dataset " + hash, "", found, "what came over the network has another content",
                      "run 'legopt dataset pack' again for legopt-server --datasets, or delete the experiments of the "
                      "database that stores it and submit them again"});
  }
  std::error_code error;
  fs::rename(unpacked.path(), folder_ / hash, error);
  // Another worker may have added the same content first.
  if (error) {
    if (const auto other = Find(hash)) return *other;
    Refuse(folder_ / hash, "cannot be made: " + error.message(), "set XDG_CACHE_HOME to another folder");
  }
  return folder_ / hash;
}

}  // namespace legopt::worker

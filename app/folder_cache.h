#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "legopt/types/byte_cache.h"
#include "legopt/types/read_guard.h"

namespace legopt {

/// A ByteCache in a folder, one file per entry. Files are replaced in one step; each has a checksum, so that damaged
/// files and those of other versions are ignored and written again. The checksum of a file that was not written since
/// the last Read() is not computed again. If the files exceed the size limit, those that were not used for the longest
/// time are removed. Thread-safe, also between processes.
class FolderCache : public ByteCache {
 public:
  static constexpr std::uintmax_t kMaxBytes = std::uintmax_t{1} << 30;  ///< default size limit

  /// The folder is created at the first write.
  explicit FolderCache(std::filesystem::path folder, std::uintmax_t max_bytes = kMaxBytes);

  std::optional<std::string> Read(std::string_view key) const override;
  void Write(std::string_view key, std::string_view bytes) const override;

 private:
  std::filesystem::path FileOf(std::string_view key) const;
  /// Returns true if the entry was read before and its file has had this time since.
  bool IsVerified(std::string_view key, std::filesystem::file_time_type time) const;
  void RemoveOldest() const;

  std::filesystem::path folder_;
  std::uintmax_t max_bytes_;
  mutable std::mutex mutex_;
  mutable std::map<std::string, std::filesystem::file_time_type, std::less<>> verified_;  ///< times of files, by key
};

/// Returns the cache of prepared meshes: the folder LEGOPT_CACHE, else `legopt/meshes` below XDG_CACHE_HOME or
/// ~/.cache. Null if LEGOPT_CACHE is `off`, or if there is no such folder.
std::shared_ptr<const ByteCache> MeshCache();

/// Returns the guard that the programs pass to all readers: CallIsolated with MeshCache().
ReadGuard GuardedReader();

}  // namespace legopt

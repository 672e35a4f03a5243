#pragma once

#include <filesystem>

namespace legopt::db {

/// The right to be the one writer of a database, held while this object lives: flock on a side file of its own (never
/// on the database, whose POSIX locks belong to SQLite). The kernel releases it however the process ends, so no
/// clean-up is ever needed; a clean end removes the file.
class LockFile {
 public:
  /// Throws StoreError: kLocked (naming the holder's host and process id), kUnwritable.
  explicit LockFile(const std::filesystem::path& path);
  ~LockFile();
  LockFile(const LockFile&) = delete;
  LockFile& operator=(const LockFile&) = delete;

 private:
  std::filesystem::path path_;
  int descriptor_ = -1;
};

}  // namespace legopt::db

#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace legopt::db {

/// The right to be the one writer of a database, held while this object lives: flock on a side file of its own (never
/// on the database, whose POSIX locks belong to SQLite). The kernel releases it however the process ends, so no
/// clean-up is ever needed; a clean end removes the file.
///
/// The file also names the sessions (db/file_state.h) that the log of the database may belong to. As long as there is a
/// log, the file stays when its holder ends, so that the log is never read beside another database file.
class LockFile {
 public:
  /// Throws StoreError: kLocked (naming the holder's host and process id), kUnwritable.
  explicit LockFile(const std::filesystem::path& database);
  ~LockFile();
  LockFile(const LockFile&) = delete;
  LockFile& operator=(const LockFile&) = delete;

  /// Replaces the sessions that the file names.
  void NameSessions(const std::vector<std::string>& sessions);
  /// The sessions that the lock file of this database names; none without a lock file.
  static std::vector<std::string> SessionsFor(const std::filesystem::path& database);

 private:
  std::filesystem::path database_, path_;
  int descriptor_ = -1;
  std::vector<std::string> sessions_;
};

}  // namespace legopt::db

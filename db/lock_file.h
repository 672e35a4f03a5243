#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace legopt::db {

/// Lock of the single writer of a database, held while this object exists: a flock on a separate side file. The
/// database file itself is never locked this way, because its POSIX locks belong to SQLite. The kernel releases the
/// lock however the process ends, so no clean-up is needed; the destructor removes the file.
///
/// The file also lists the sessions (db/file_state.h) to which the log of the database may belong. While a log exists,
/// the file is kept after its holder ends, so that the log is never applied to another database file.
class LockFile {
 public:
  /// Throws StoreError: kLocked (with the holder's host and process id), kUnwritable.
  explicit LockFile(const std::filesystem::path& database);
  ~LockFile();
  LockFile(const LockFile&) = delete;
  LockFile& operator=(const LockFile&) = delete;

  /// Replaces the listed sessions.
  void NameSessions(const std::vector<std::string>& sessions);
  /// Returns the sessions listed in the lock file of this database; empty without a lock file.
  static std::vector<std::string> SessionsFor(const std::filesystem::path& database);

 private:
  std::filesystem::path database_, path_;
  int descriptor_ = -1;
  std::vector<std::string> sessions_;
};

}  // namespace legopt::db

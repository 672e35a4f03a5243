#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace legopt::db {

/// Throws StoreError (kCorrupt) for damage to a database file, or to the write-ahead log beside it, that SQLite reads
/// as something else. Returns for files that are no database, that cannot be read, or that SQLite itself refuses.
/// Changes nothing. Reads all of the log. A server may write to both files meanwhile. Thread-safe.
///
/// SQLite fills a last page that is cut off with zeros. It opens a file of an unknown format version read-only, as if
/// permissions were missing. It ends a log at the first frame whose checksum is wrong, as after a loss of power, and
/// silently drops every commit behind it. A loss of power can only hit the last commit, since each commit is on the
/// disk before the next is written. So a wrong frame before a whole commit that is not the last is damage, and so is a
/// wrong header, unless the process died while it restarted the log.
void RequireSoundFiles(const std::filesystem::path& file);

/// Returns true if SQLite would create a `-shm` of this user beside the file of another user. A reader does not remove
/// it, and the file's owner cannot write to it, so no server could open the database any more. Always false for root,
/// whose side files SQLite gives to the file's owner. Such a file is read without side files: the file alone, or a
/// PrivateCopy.
bool WouldLeaveSideFiles(const std::filesystem::path& file);

/// A copy of a database file and its log in a new folder in TMPDIR that only this user can read. The destructor removes
/// it; connections that are still open can continue to read.
///
/// Needed to read a database with a log where SQLite cannot create its side file `-shm`, or must not
/// (WouldLeaveSideFiles): on a read-only disk, in a folder of another user, or beside a file of another user. Must not
/// be used by a process that has the database open, because closing a file drops its locks.
class PrivateCopy {
 public:
  /// Throws StoreError: kUnwritable (the folder cannot be created), kFull (no space), kBusy (a server is writing the
  /// file).
  explicit PrivateCopy(const std::filesystem::path& file);

  std::filesystem::path path() const;

 private:
  class Folder {
   public:
    explicit Folder(const std::filesystem::path& file);
    ~Folder();
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;
    const std::filesystem::path& path() const { return path_; }

   private:
    std::filesystem::path path_;
  };
  Folder folder_;
};

class Connection;
class LockFile;

// The session of a database: an id in the table `file_state` that changes each time a server opens the file, and in
// each backup. It shows whether the write-ahead log beside a file was written for that file. SQLite does not check
// this; it would overwrite pages of the file with pages of a foreign log.

/// Returns the session that this connection sees; nullopt before schema version 10.
std::optional<std::string> SessionOf(Connection& connection);

/// Throws StoreError (kCorrupt) if the file or its log is damaged (RequireSoundFiles), or if the log beside `file` was
/// written for another file. The latter happens when a backup is copied over a database whose server was killed.
/// Changes nothing.
void RequireOwnLog(const std::filesystem::path& path);

/// Assigns a new session and writes it to the database and to its lock file. If a reader prevents the log from being
/// moved into the file, the previous session is kept. The connection must be the only writer and have no open
/// transaction.
void BeginSession(Connection& connection, LockFile& lock);

/// Assigns a new session to a copy. Does nothing before schema version 10.
void RenewSession(Connection& copy);

}  // namespace legopt::db

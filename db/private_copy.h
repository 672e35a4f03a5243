#pragma once

#include <filesystem>

namespace legopt::db {

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

}  // namespace legopt::db

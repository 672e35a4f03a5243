#pragma once

#include <filesystem>

namespace legopt::db {

/// A database file and its log, copied into a new folder of TMPDIR that only this user can read; removed by the
/// destructor. Connections that are open by then keep reading it.
///
/// For a database whose log has to be read where SQLite cannot create its side file `-shm`: on a read-only disk, or in
/// a folder of another user. Must not be used by a process that has the database open: closing a file drops its locks.
class PrivateCopy {
 public:
  /// Throws StoreError: kUnwritable (no folder can be made), kFull (no room), kBusy (a server is writing the file).
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

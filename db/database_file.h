#pragma once

#include <sys/types.h>

#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "db/lock_file.h"

namespace legopt::db {

/// A database file in the hands of its one writer: the right to write it, and the knowledge whether its names still
/// lead to it. A path is only one name of a file: symbolic and hard links, bind mounts and renames make others.
///
/// The right is two locks, both released by the kernel however the process ends. The first is LockFile beside the real
/// path, which also tells people who holds it. The second is flock on the file itself, which follows the file whatever
/// name leads to it. flock belongs to the open file description and on local Linux file systems neither sees nor
/// disturbs SQLite's POSIX locks. But closing any descriptor of a file drops all POSIX locks that the process has on
/// it, so this object must outlive every SQLite connection of its process to the file. File systems where
/// this does not hold are refused (file_system.h).
///
/// Thread rule: one thread at a time.
class DatabaseFile {
 public:
  /// Opens the file, creating it empty when it is missing, and takes both locks. Throws StoreError: kLocked (naming the
  /// holder's host and process id), kUnwritable.
  explicit DatabaseFile(const std::filesystem::path& path);
  ~DatabaseFile();
  DatabaseFile(const DatabaseFile&) = delete;
  DatabaseFile& operator=(const DatabaseFile&) = delete;

  /// The path without symbolic links, as it was when the file was opened.
  const std::filesystem::path& path() const { return path_; }

  /// From now on the side files of the write-ahead log that exist belong to the file: they must stay as well.
  void RememberSideFiles();

  LockFile& lock() { return *lock_; }

  enum class Place {
    kThere,      ///< path and side files lead to what was opened
    kElsewhere,  ///< the file has another name now
    kNowhere,    ///< the file has no name left: it is gone when the process ends
    kSideFile,   ///< the file is there, but a side file is gone or another one
  };
  Place Look() const;

  /// What happened, for humans: "the file was moved to /x/y.sqlite".
  std::string Describe(Place place) const;
  /// A path through which this process's open file can be read as long as it lives.
  std::string DescriptorPath() const;

 private:
  struct Identity {
    dev_t device = 0;
    ino_t inode = 0;
    bool operator==(const Identity&) const = default;
  };
  static constexpr std::array<const char*, 2> kSideFiles = {"-wal", "-shm"};

  static std::optional<Identity> IdentityOf(const std::filesystem::path& path);
  void CloseAndRemoveEmpty();
  void Open(const std::filesystem::path& path);
  void LockItself();

  std::filesystem::path path_;
  bool created_ = false;
  int descriptor_ = -1;
  Identity identity_;
  std::array<std::optional<Identity>, kSideFiles.size()> side_files_;
  std::unique_ptr<LockFile> lock_;
};

}  // namespace legopt::db

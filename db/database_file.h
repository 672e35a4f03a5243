#pragma once

#include <sys/types.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace legopt::db {

/// Returns the name of a file system that is not safe for databases, given its type (statfs(2)): network and cluster
/// file systems and FUSE. SQLite's write-ahead log needs shared memory between all processes that open the file, and
/// reliable locks; these file systems do not guarantee both. Returns nullopt for all other types.
std::optional<std::string_view> UnsupportedFileSystemName(std::int64_t type);

/// Returns the type of the file system of a file (for a new file, of its folder); nullopt if unknown.
std::optional<std::int64_t> FileSystemOf(const std::filesystem::path& file);

/// Disk space of a file system available to an unprivileged user.
struct DiskSpace {
  std::int64_t free_bytes = 0, total_bytes = 0;
};

/// Returns the disk space of a file's file system; nullopt if unknown.
std::optional<DiskSpace> SpaceAt(const std::filesystem::path& file);

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

/// The database file as seen by its single writer. Holds the write locks and detects whether the path still leads to
/// the opened file; symbolic links, hard links, bind mounts and renames give a file other names.
///
/// There are two locks; the kernel releases both however the process ends. The first is a LockFile beside the real
/// path; it also shows the user which process holds it. The second is a flock on the file itself, which applies
/// whatever name was used to open it. flock belongs to the open file description; on local Linux file systems it is
/// independent of SQLite's POSIX locks. But closing any descriptor of a file drops all POSIX locks that the process has
/// on it, so this object must outlive every SQLite connection of its process to the file. File systems on which this
/// does not hold are refused (database_file.h).
///
/// Thread rule: one thread at a time.
class DatabaseFile {
 public:
  /// Opens the file, creating an empty one if missing, and takes both locks. Throws StoreError: kLocked (with the
  /// holder's host and process id), kUnwritable.
  explicit DatabaseFile(const std::filesystem::path& path);
  ~DatabaseFile();
  DatabaseFile(const DatabaseFile&) = delete;
  DatabaseFile& operator=(const DatabaseFile&) = delete;

  /// Path with all symbolic links resolved when the file was opened.
  const std::filesystem::path& path() const { return path_; }

  /// Records the existing side files of the write-ahead log; from now on Look checks them as well.
  void RememberSideFiles();

  LockFile& lock() { return *lock_; }

  enum class Place {
    kThere,      ///< path and side files lead to the opened files
    kElsewhere,  ///< the file has another name now
    kNowhere,    ///< the file has been unlinked; its contents are lost when the process ends
    kSideFile,   ///< the file is in place, but a side file was removed or replaced
  };
  Place Look() const;

  /// Returns a sentence for the user, such as "the file was moved to /x/y.sqlite".
  std::string Describe(Place place) const;
  /// Path through which the open file can be read while this process lives.
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

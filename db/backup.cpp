#include "db/backup.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>

#include "db/audit.h"
#include "db/connection.h"
#include "db/file_state.h"
#include "db/migrations.h"
#include "db/read_only_database.h"
#include "legopt/files/file_error.h"
#include "legopt/files/written_file.h"

namespace legopt::db {
namespace {

[[noreturn]] void Fail(StoreErrorCode code, const std::filesystem::path& file, const std::string& what) {
  throw StoreError(code, file.string() + ": " + what);
}

std::string LastError() { return std::strerror(errno); }

// The copy while it is being written. The destructor removes it unless Finish succeeded.
class PartialFile {
 public:
  explicit PartialFile(const std::filesystem::path& target)
      : target_(target), path_(target.string() + ".partial-" + std::to_string(::getpid())) {
    const std::string stem = path_;
    std::error_code ignored;
    if (std::filesystem::exists(std::filesystem::symlink_status(target, ignored))) {
      Fail(StoreErrorCode::kUnwritable, target, "exists already and is not overwritten; choose another name");
    }
    try {
      // In a container, a copy that a killed backup has left may have the process id of this one.
      for (int i = 2; !files::ReserveFileName(path_); ++i) path_ = stem + "-" + std::to_string(i);
    } catch (const files::FileError& error) {
      throw StoreError(error.shortage() ? StoreErrorCode::kShortage : StoreErrorCode::kUnwritable, error.what());
    }
  }
  ~PartialFile() {
    for (const char* suffix : {"", "-journal", "-wal", "-shm"}) ::unlink((path_.string() + suffix).c_str());
  }
  PartialFile(const PartialFile&) = delete;
  PartialFile& operator=(const PartialFile&) = delete;

  const std::filesystem::path& path() const { return path_; }

  // Syncs the copy and renames it to the target unless that name exists by now.
  void Finish() {
    Sync(path_, O_RDONLY);
    if (::renameat2(AT_FDCWD, path_.c_str(), AT_FDCWD, target_.c_str(), RENAME_NOREPLACE) != 0) {
      // Some file systems do not support RENAME_NOREPLACE; a hard link never replaces an existing file either.
      const bool linked = errno != EEXIST && ::link(path_.c_str(), target_.c_str()) == 0;
      if (!linked) Fail(StoreErrorCode::kUnwritable, target_, "cannot be given its name: " + LastError());
    }
    const std::filesystem::path folder = target_.parent_path();
    Sync(folder.empty() ? "." : folder, O_RDONLY | O_DIRECTORY);
  }

 private:
  static void Sync(const std::filesystem::path& path, int flags) {
    const int fd = ::open(path.c_str(), flags | O_CLOEXEC);
    const bool synced = fd >= 0 && ::fsync(fd) == 0;
    const std::string reason = LastError();
    if (fd >= 0) ::close(fd);
    if (!synced) Fail(StoreErrorCode::kIo, path, "cannot be synced to the disk: " + reason);
  }

  std::filesystem::path target_;
  std::filesystem::path path_;
};

BackupReport Describe(Connection& copy) {
  BackupReport report;
  report.schema_version = copy.QueryInt("PRAGMA user_version");
  report.bytes = copy.QueryInt("PRAGMA page_count") * copy.QueryInt("PRAGMA page_size");
  report.experiments = copy.QueryInt("SELECT count(*) FROM experiments");
  report.jobs = copy.QueryInt("SELECT count(*) FROM jobs");
  report.results = copy.QueryInt("SELECT count(*) FROM results");
  return report;
}

}  // namespace

BackupReport BackUp(const std::filesystem::path& source, const std::filesystem::path& target) {
  const std::unique_ptr<Connection> live = OpenForReading(source);
  const Identity identity = Identify(*live);
  if (identity.empty) Fail(StoreErrorCode::kNotLegopt, source, "empty, not a legopt database; check the path");
  if (identity.version == SchemaVersion()) RequireIntact(*live);
  return BackUp(*live, target);
}

BackupReport BackUp(Connection& source, const std::filesystem::path& target) {
  PartialFile partial(target);
  BackupReport report;
  {
    Connection copy(partial.path(), Connection::Mode::kReadWriteCreate);
    copy.Execute("PRAGMA synchronous = FULL");
    copy.CopyFrom(source);
    // Write a single file without side files, which can be read in read-only folders. A server switches back to
    // write-ahead logging.
    copy.Execute("PRAGMA journal_mode = DELETE");
    RenewSession(copy);
    if (const auto defects = AuditFile(copy); !defects.empty()) {
      Fail(StoreErrorCode::kCorrupt, source.path(),
           "the copy is not sound (" + defects.front().detail +
               "), so the database is not either; restore an older backup");
    }
    report = Describe(copy);
  }
  if (report.schema_version < SchemaVersion()) {
    Connection copy(partial.path(), Connection::Mode::kReadWriteCreate, source.path());
    RequireUpgradable(copy);
  }
  partial.Finish();
  return report;
}

}  // namespace legopt::db

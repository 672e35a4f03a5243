#include "db/backup.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <memory>
#include <string>
#include <system_error>

#include "db/audit.h"
#include "db/connection.h"
#include "db/database_file.h"
#include "db/file_state.h"
#include "db/migrations.h"
#include "db/read_only_database.h"
#include "db/store_error.h"
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

namespace {

namespace fs = std::filesystem;

[[noreturn]] void FailToMove(const fs::path& file, const std::error_code& error) {
  throw StoreError(StoreErrorCode::kUnwritable,
                   file.string() + ": cannot be moved away: " + error.message() + "; check the folder's permissions");
}

constexpr std::array<const char*, 4> kParts = {"", "-wal", "-shm", "-journal"};

bool IsTaken(const fs::path& name) {
  const auto exists = [&](const char* part) { return fs::exists(fs::symlink_status(name.string() + part)); };
  return std::any_of(kParts.begin(), kParts.end(), exists);
}

// Returns the `attempt`th name of `stem`, counted from 1: "stem", "stem-2", ...
fs::path NumberedName(const std::string& stem, int attempt) {
  return attempt == 1 ? stem : stem + "-" + std::to_string(attempt);
}

fs::path FreeName(const std::string& stem) {
  int attempt = 1;
  while (IsTaken(NumberedName(stem, attempt))) ++attempt;
  return NumberedName(stem, attempt);
}

// Returns e.g. "results.sqlite.replaced-20261126T174500Z".
std::string StemOfReplaced(const fs::path& database) {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char time[32];
  std::strftime(time, sizeof(time), "%Y%m%dT%H%M%SZ", &utc);
  return database.string() + ".replaced-" + time;
}

void MoveSideFiles(const fs::path& database, const fs::path& away) {
  for (const char* suffix : {"-wal", "-shm", "-journal"}) {
    std::error_code error;
    fs::rename(database.string() + suffix, away.string() + suffix, error);
    if (error && error != std::errc::no_such_file_or_directory) FailToMove(database.string() + suffix, error);
  }
}

// Adds a free name to the file and returns it. Sets `error` to 0 or errno.
fs::path AddName(const fs::path& database, int* error) {
  const std::string stem = StemOfReplaced(database);
  while (true) {
    fs::path away = FreeName(stem);
    *error = ::link(database.c_str(), away.c_str()) == 0 ? 0 : errno;
    if (*error == EEXIST) continue;  // another process used it meanwhile
    // file system without hard links
    if (*error != 0) *error = ::rename(database.c_str(), away.c_str()) == 0 ? 0 : errno;
    return away;
  }
}

// Swaps the files such that the former file always has a name: first its new name is added, then the copy takes the old
// one. Returns the new name.
fs::path Exchange(const fs::path& copy, const fs::path& database) {
  int failure = 0;
  const fs::path away = AddName(database, &failure);
  if (failure != 0) FailToMove(database, {failure, std::generic_category()});
  std::error_code error;
  fs::rename(copy, database, error);
  if (!error) return away;
  std::error_code ignored;
  fs::rename(away, database, ignored);
  FailToMove(database, error);
}

}  // namespace

RestoreReport Restore(const fs::path& backup, const fs::path& database) {
  std::error_code error;
  if (fs::equivalent(backup, database, error)) {
    throw StoreError(StoreErrorCode::kUnwritable,
                     database.string() + ": is the backup itself; name the file that it shall replace");
  }
  const fs::path copy = FreeName(fs::weakly_canonical(database).string() + ".restored-" + std::to_string(::getpid()));
  RestoreReport report;
  report.content = BackUp(backup, copy);
  try {
    const bool existed = fs::exists(database, error) && !fs::is_empty(database, error);
    const DatabaseFile former(database);  // locks out other writers until the end of this block
    const fs::path away = Exchange(copy, former.path());
    MoveSideFiles(former.path(), away);
    if (existed) {
      report.moved_away = away;
    } else {
      fs::remove(away, error);
    }
  } catch (...) {
    fs::remove(copy, error);
    throw;
  }
  return report;
}

}  // namespace legopt::db

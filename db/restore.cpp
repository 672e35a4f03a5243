#include "db/restore.h"

#include <unistd.h>

#include <cerrno>
#include <ctime>
#include <string>
#include <system_error>

#include "db/database_file.h"
#include "db/store_error.h"

namespace legopt::db {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void FailToMove(const fs::path& file, const std::error_code& error) {
  throw StoreError(StoreErrorCode::kUnwritable,
                   file.string() + ": cannot be moved away: " + error.message() + "; check the folder's permissions");
}

// Returns e.g. "results.sqlite.replaced-20261126T174500Z"; a number is appended if the name exists.
fs::path FreeName(const fs::path& database) {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char time[32];
  std::strftime(time, sizeof(time), "%Y%m%dT%H%M%SZ", &utc);
  const std::string name = database.string() + ".replaced-" + time;
  fs::path free = name;
  for (int i = 2; fs::exists(fs::symlink_status(free)); ++i) free = name + "-" + std::to_string(i);
  return free;
}

void MoveSideFiles(const fs::path& database, const fs::path& away) {
  for (const char* suffix : {"-wal", "-shm", "-journal"}) {
    std::error_code error;
    fs::rename(database.string() + suffix, away.string() + suffix, error);
    if (error && error != std::errc::no_such_file_or_directory) FailToMove(database.string() + suffix, error);
  }
}

// Swaps the files such that the former file always has a name: first its new name is added, then the copy takes the old
// one.
void Exchange(const fs::path& copy, const fs::path& database, const fs::path& away) {
  std::error_code error;
  fs::create_hard_link(database, away, error);
  if (error) fs::rename(database, away, error);  // file system without hard links
  if (error) FailToMove(database, error);
  fs::rename(copy, database, error);
  if (!error) return;
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
  const fs::path copy = fs::weakly_canonical(database).string() + ".restored-" + std::to_string(::getpid());
  RestoreReport report;
  report.content = BackUp(backup, copy);
  try {
    const bool existed = fs::exists(database, error) && !fs::is_empty(database, error);
    const DatabaseFile former(database);  // locks out other writers until the end of this block
    const fs::path away = FreeName(former.path());
    Exchange(copy, former.path(), away);
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

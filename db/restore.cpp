#include "db/restore.h"

#include <unistd.h>

#include <algorithm>
#include <array>
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

#include "db/file_state.h"

#include <algorithm>
#include <system_error>
#include <utility>
#include <vector>

#include "db/connection.h"
#include "db/file_check.h"
#include "db/lock_file.h"
#include "db/private_copy.h"

namespace legopt::db {
namespace {

constexpr char kNewSession[] = "UPDATE file_state SET session = lower(hex(randomblob(16)))";

bool HasLog(const std::filesystem::path& file) {
  std::error_code error;
  const auto size = std::filesystem::file_size(file.string() + "-wal", error);
  return !error && size > 0;
}

[[noreturn]] void ThrowForeignLog(const std::filesystem::path& file) {
  const std::string name = file.string();
  throw StoreError(
      StoreErrorCode::kCorrupt,
      name + ": the log " + name +
          "-wal beside it was written for another file (was a backup copied over a database?); to restore "
          "a backup: 'legopt service restore BACKUP --db FILE'; to read this file as it is, move its -wal, -shm "
          "and .lock away");
}

// Returns the session stored in the file itself, ignoring its log; "" if it has none. Returns nullopt if the file is
// damaged; the caller reads more of the file and reports the damage.
std::optional<std::string> SessionInFile(const std::filesystem::path& file) {
  try {
    Connection connection(file, Connection::Mode::kImmutable);
    return SessionOf(connection).value_or("");
  } catch (const StoreError&) {
    return std::nullopt;
  }
}

// Returns the session of file and log together. A foreign log makes the database malformed in arbitrary places.
std::optional<std::string> SessionWithLog(const std::filesystem::path& file) {
  try {
    std::optional<PrivateCopy> copy;
    if (WouldLeaveSideFiles(file)) copy.emplace(file);
    Connection connection(copy ? copy->path() : file, Connection::Mode::kReadOnly);
    return SessionOf(connection).value_or("");
  } catch (const StoreError& error) {
    if (error.code() == StoreErrorCode::kCorrupt || error.code() == StoreErrorCode::kNotLegopt) ThrowForeignLog(file);
    return std::nullopt;
  }
}

// Returns false if a reader still needs part of the log.
bool CheckpointAll(Connection& connection) {
  Statement checkpoint(connection, "PRAGMA wal_checkpoint(PASSIVE)", false);
  return checkpoint.Step() && checkpoint.column_int(1) == checkpoint.column_int(2);
}

}  // namespace

std::optional<std::string> SessionOf(Connection& connection) {
  if (connection.QueryInt("SELECT count(*) FROM sqlite_schema WHERE name = 'file_state' AND type = 'table'") == 0) {
    return std::nullopt;
  }
  return connection.QueryText("SELECT session FROM file_state");
}

void RequireOwnLog(const std::filesystem::path& path) {
  std::error_code error;
  const std::filesystem::path canonical = std::filesystem::canonical(path, error);
  const std::filesystem::path& file = error ? path : canonical;  // side files are next to the real file
  RequireSoundFiles(file);
  std::vector<std::string> named = LockFile::SessionsFor(file);
  while (HasLog(file)) {
    const std::optional<std::string> in_file = SessionInFile(file);
    if (!in_file) return;
    const std::vector<std::string> named_before = std::exchange(named, LockFile::SessionsFor(file));
    if (named != named_before) continue;  // a server is just starting
    if (std::find(named.begin(), named.end(), *in_file) != named.end()) return;
    if (!named.empty()) ThrowForeignLog(file);
    // The log has no lock file. If the database has sessions, every commit writes the session's row, so the log
    // contains it.
    const std::optional<std::string> with_log = SessionWithLog(file);
    if (with_log && !in_file->empty() && with_log != in_file) ThrowForeignLog(file);
    return;
  }
}

void BeginSession(Connection& connection, LockFile& lock) {
  // Write the session to the lock file only after it is in the database file.
  if (!CheckpointAll(connection)) return;
  const std::string before = SessionOf(connection).value_or("");
  std::string session;
  {
    Transaction transaction(connection);
    connection.Execute(kNewSession);
    session = SessionOf(connection).value_or("");
    lock.NameSessions({before, session});
    transaction.Commit();
  }
  // Until the whole log is in the file, the file may still contain the previous session.
  if (CheckpointAll(connection)) lock.NameSessions({session});
}

void RenewSession(Connection& copy) {
  if (SessionOf(copy)) copy.Execute(kNewSession);
}

}  // namespace legopt::db

#pragma once

#include <cstdint>
#include <filesystem>

#include "db/store_error.h"

namespace legopt::db {

class Connection;

/// Contents of a backup, counted in the finished copy.
struct BackupReport {
  std::int64_t schema_version = 0;
  std::int64_t bytes = 0;
  std::int64_t experiments = 0;
  std::int64_t jobs = 0;
  std::int64_t results = 0;
};

/// Copies a legopt database of this or an older schema to the new file `target`; a server may be writing to the source.
/// The copy is one commit of the source's history. It is checked (integrity, foreign keys) and synced before it appears
/// as `target`, and has its own session (db/file_state.h). No file is ever overwritten. A failure leaves no file
/// behind; a crash may leave `<target>.partial-PID`.
///
/// The source is opened read-only and read in one transaction by SQLite's backup interface. The server remains the only
/// writer and the only process that checkpoints, and it continues to work during the copy; its log grows until the copy
/// is done. The server makes no backups itself, because a request for one would have to contain a path.
///
/// Throws StoreError: kNotFound, kNotLegopt, kNewerSchema, kCorrupt (the source's damage shows in the copy),
/// kUnwritable (also when `target` exists), kFull, kIo, kBusy. Thread rule: any thread; not across fork().
BackupReport BackUp(const std::filesystem::path& source, const std::filesystem::path& target);

/// Copies the database of an open connection, which must have the current schema and no open transaction.
BackupReport BackUp(Connection& source, const std::filesystem::path& target);

struct RestoreReport {
  BackupReport content;              ///< contents of the restored file
  std::filesystem::path moved_away;  ///< new path of the former file and its log; empty if there was none
};

/// Replaces `database` by a copy of `backup`. The copy is checked like a backup, synced, and renamed atomically. The
/// former file, its -wal and its -shm are moved to `<database>.replaced-TIME`, so that its log is never applied to the
/// copy. If the process is killed in between, one of the two files is in place and complete. If the former log is still
/// there, RequireOwnLog refuses it, and a second call moves it away.
///
/// Throws StoreError: the codes of BackUp, and kLocked (with the server that uses `database`). Thread rule: any thread;
/// not across fork().
RestoreReport Restore(const std::filesystem::path& backup, const std::filesystem::path& database);

}  // namespace legopt::db

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

}  // namespace legopt::db

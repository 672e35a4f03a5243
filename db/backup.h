#pragma once

#include <cstdint>
#include <filesystem>

#include "db/store_error.h"

namespace legopt::db {

class Connection;

/// What a backup holds, counted in the finished copy.
struct BackupReport {
  std::int64_t schema_version = 0;
  std::int64_t bytes = 0;
  std::int64_t experiments = 0;
  std::int64_t jobs = 0;
  std::int64_t results = 0;
};

/// Copies a legopt database of this or an older schema, also one that a server is writing to, into the new file
/// `target`: one commit of its history, checked (integrity, foreign keys), synced, and complete when it appears under
/// its name. The copy has a session of its own (db/file_state.h). Nothing is ever overwritten; a failure leaves nothing
/// but, after a crash, `<target>.partial-PID`.
///
/// The source is opened read-only and read in one transaction by SQLite's backup interface, so the server remains the
/// only writer and the only one that checkpoints, and goes on meanwhile; its log grows until the copy is done. The
/// server itself makes no backups, because a request for one would have to name a path.
///
/// Throws StoreError: kNotFound, kNotLegopt, kNewerSchema, kCorrupt (the source's damage shows in the copy),
/// kUnwritable (also when `target` exists), kFull, kIo, kBusy. Thread rule: any thread; not across fork().
BackupReport BackUp(const std::filesystem::path& source, const std::filesystem::path& target);

/// The same through an open connection to the source, which must be of the present schema and in no transaction.
BackupReport BackUp(Connection& source, const std::filesystem::path& target);

}  // namespace legopt::db

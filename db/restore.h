#pragma once

#include <filesystem>

#include "db/backup.h"

namespace legopt::db {

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

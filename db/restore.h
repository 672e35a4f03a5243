#pragma once

#include <filesystem>

#include "db/backup.h"

namespace legopt::db {

struct RestoreReport {
  BackupReport content;              ///< what the restored file holds
  std::filesystem::path moved_away;  ///< where the former file is, with its log beside it; empty: there was none
};

/// Puts a copy of `backup` in the place of `database`. The copy is checked as by BackUp and synced, and takes the name
/// in one step; the former file and its -wal and -shm are moved to `<database>.replaced-TIME`, so that its log is never
/// read beside the copy. A process that is killed in between leaves one file or the other, whole; should the former log
/// still lie there, RequireOwnLog refuses it, and a second call moves it away.
///
/// Throws StoreError as BackUp, and kLocked (naming the server that works on `database`). Thread rule: any thread; not
/// across fork().
RestoreReport Restore(const std::filesystem::path& backup, const std::filesystem::path& database);

}  // namespace legopt::db

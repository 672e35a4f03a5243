#pragma once

#include <filesystem>

#include "db/backup.h"

namespace legopt::db {

struct RestoreReport {
  BackupReport content;              ///< contents of the restored file
  std::filesystem::path moved_away;  ///< where the former file is, with its log beside it; empty: there was none
};

/// Puts a copy of `backup` in the place of `database`. The copy is checked as by BackUp and synced, and takes the name
/// in one step. The former file, its -wal and its -shm are moved to `<database>.replaced-TIME`, so that its log is
/// never applied to the copy. If the process is killed in between, one of the two files is there and complete; if the
/// former log is still there, RequireOwnLog refuses it, and a second call moves it away.
///
/// Throws StoreError as BackUp, and kLocked (naming the server that works on `database`). Thread rule: any thread; not
/// across fork().
RestoreReport Restore(const std::filesystem::path& backup, const std::filesystem::path& database);

}  // namespace legopt::db

#pragma once

#include <filesystem>
#include <memory>

#include "db/store.h"

namespace legopt::db {

/// Opens (creates, upgrades) the database for the single server that may write to it.
///
/// Takes the exclusive lock `<path>.lock` (a flock, which the kernel releases however the process ends). Checks that
/// the file is a legopt database of a known schema, that the log beside it belongs to it, and that its pages are
/// undamaged. Upgrades the tables, creates all views anew, and sets WAL with synchronous FULL. Throws StoreError:
/// kUnwritable, kLocked, kNotLegopt, kNewerSchema, kOlderSchema (too old to be upgraded), kCorrupt, kFull, kIo, kBusy.
std::unique_ptr<Store> OpenSqliteStore(const std::filesystem::path& path);

}  // namespace legopt::db

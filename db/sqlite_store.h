#pragma once

#include <filesystem>
#include <memory>

#include "db/store.h"

namespace legopt::db {

/// Opens (creates, upgrades) the database for the one server that may write to it.
///
/// Takes the exclusive lock `<path>.lock` (flock: released by the kernel however the process ends), checks that the
/// file is legopt's and not newer, that the log beside it is its own and that its pages are sound, applies missing
/// migrations, each in one transaction, and sets WAL with synchronous FULL. Throws StoreError: kUnwritable, kLocked,
/// kNotLegopt, kNewerSchema, kCorrupt, kFull, kIo, kBusy.
std::unique_ptr<Store> OpenSqliteStore(const std::filesystem::path& path);

}  // namespace legopt::db

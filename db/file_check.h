#pragma once

#include <filesystem>

namespace legopt::db {

/// Throws StoreError (kCorrupt) for damage to a database file, or to the write-ahead log beside it, that SQLite reads
/// as something else. Returns for files that are no database, that cannot be read, or that SQLite itself refuses.
/// Changes nothing. Reads all of the log. A server may write to both files meanwhile. Thread-safe.
///
/// SQLite fills a last page that is cut off with zeros. It opens a file of an unknown format version read-only, as if
/// permissions were missing. It ends a log at the first frame whose checksum is wrong, as after a loss of power, and
/// silently drops every commit behind it. A loss of power can only hit the last commit, since each commit is on the
/// disk before the next is written. So a wrong frame before a whole commit that is not the last is damage, and so is a
/// wrong header, unless the process died while it restarted the log.
void RequireSoundFiles(const std::filesystem::path& file);

}  // namespace legopt::db

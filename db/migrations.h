#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace legopt::db {

class Connection;

/// "LGOP" in the file's header: how a legopt database is recognised (also by file(1)).
inline constexpr std::int64_t kApplicationId = 0x4C474F50;

/// One step of the schema: from version - 1 to version. Released steps never change.
struct Migration {
  int version;
  std::string_view sql;
};

/// All steps, version 1 first; db/schema/*.sql, embedded by the build.
std::span<const Migration> Migrations();

/// The schema version this program writes.
int SchemaVersion();

/// What a file is, found without changing it.
struct Identity {
  bool empty = false;        ///< no tables, no marks: a new file
  std::int64_t version = 0;  ///< schema version
};

/// Throws StoreError: kNotLegopt, kNewerSchema (than `newest`), kCorrupt (no version).
Identity Identify(Connection& connection, int newest);

/// One entry of `sqlite_schema` that is not as the schema version of the file has it.
struct SchemaDefect {
  enum class Kind {
    kMissing,  ///< an entry, or a column, of the schema is not there
    kChanged,  ///< its text is another one
    kForeign,  ///< an entry that changes what legopt reads or writes
  };
  Kind kind{};
  std::string entry;  ///< "view 'benchmark_table'", "column 'state' of table 'jobs'", "trigger 'x' on table 'jobs'"
};

/// Compares the text of every entry with that of the schema version that the file says it has. A user's own tables and
/// views, and indexes that are not unique, may be there; triggers, and unique indexes on legopt's tables, may not.
std::vector<SchemaDefect> SchemaDefects(Connection& connection, std::int64_t version);

/// Throws StoreError (kCorrupt) naming the first of SchemaDefects.
void RequireIntact(Connection& connection, const Identity& identity);

/// Brings the database to the last of `migrations`, each step in one transaction together with its version mark.
/// Throws StoreError as Identify, and what SQLite reports; then the schema is that of the last complete step.
void Migrate(Connection& connection, std::span<const Migration> migrations);

}  // namespace legopt::db

#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace legopt::db {

class Connection;

/// "LGOP" in the file header; identifies a legopt database (also for file(1)).
inline constexpr std::int64_t kApplicationId = 0x4C474F50;

/// Schema migration from version - 1 to version. Released migrations never change.
struct Migration {
  int version;
  std::string_view sql;
};

/// Returns all migrations, version 1 first: db/schema/*.sql, embedded by the build.
std::span<const Migration> Migrations();

int SchemaVersion();

/// Type of a database file, determined without changing it.
struct Identity {
  bool empty = false;  ///< a new file: no tables, no application id
  std::int64_t version = 0;
};

/// Throws StoreError: kNotLegopt, kNewerSchema (newer than `newest`), kCorrupt (no version).
Identity Identify(Connection& connection, int newest);

/// An entry of `sqlite_schema` that differs from the schema version of the file.
struct SchemaDiagnostic {
  enum class Kind {
    kMissing,  ///< an entry or a column of the schema is missing
    kChanged,  ///< the text of the entry differs
    kForeign,  ///< an added entry that changes legopt's reads or writes
  };
  Kind kind{};
  std::string entry;  ///< "view 'benchmark_table'", "column 'state' of table 'jobs'", "trigger 'x' on table 'jobs'"
};

/// Compares the text of every entry with the given schema version. Additional tables, views and non-unique indexes of
/// the user are allowed; triggers, and unique indexes on legopt's tables, are not.
std::vector<SchemaDiagnostic> DiagnoseSchema(Connection& connection, std::int64_t version);

/// Throws StoreError (kCorrupt) with the first of DiagnoseSchema, if any.
void RequireIntact(Connection& connection, const Identity& identity);

/// Upgrades the database to the last of `migrations`; each migration and its version number are written in one
/// transaction. Throws StoreError: the codes of Identify, and SQLite's errors. After an error the schema is that of the
/// last complete migration.
void Migrate(Connection& connection, std::span<const Migration> migrations);

}  // namespace legopt::db

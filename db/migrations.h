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

/// Upgrade of the tables from schema version `from` to from + 1, after its columns were added. Released upgrades never
/// change.
struct Upgrade {
  int from;
  std::string_view sql;
};

/// A column that upgrades add to the tables of versions before `since`: one with the comment "since N" in tables.sql.
struct AddedColumn {
  std::string table;
  std::string definition;  ///< its line of tables.sql without the comma: "windows INTEGER CHECK (windows >= 1)"
  int since = 0;
};

/// Returns the added columns of `tables`, the text of tables.sql, in their order.
std::vector<AddedColumn> AddedColumns(std::string_view tables);

/// SQL of db/schema, embedded by the build: tables.sql, views.sql, and upgrade_from_N.sql, oldest first.
std::string_view Tables();
std::string_view Views();
std::span<const Upgrade> Upgrades();

/// The version of tables.sql and views.sql together. A change of either needs a new version.
int SchemaVersion();
/// The oldest version that Migrate upgrades.
int OldestSchemaVersion();

/// Type of a database file, determined without changing it.
struct Identity {
  bool empty = false;  ///< a new file: no tables, no application id
  std::int64_t version = 0;
};

/// Throws StoreError: kNotLegopt, kNewerSchema, kOlderSchema (before OldestSchemaVersion()), kCorrupt (no version).
Identity Identify(Connection& connection);

/// An entry of `sqlite_schema` that differs from the current schema.
struct SchemaDiagnostic {
  enum class Kind {
    kMissing,  ///< an entry or a column of the schema is missing
    kChanged,  ///< the text of the entry differs
    kForeign,  ///< an added entry that changes legopt's reads or writes
  };
  Kind kind{};
  std::string entry;  ///< "view 'benchmark_table'", "column 'state' of table 'jobs'", "trigger 'x' on table 'jobs'"
  bool view = false;  ///< a missing or changed view: a server restores it at its start
};

/// Compares the text of every entry with the current schema, ignoring comments and white space, which differ between a
/// new and an upgraded file. Additional tables, views and non-unique indexes of the user are allowed; triggers, and
/// unique indexes on legopt's tables, are not.
std::vector<SchemaDiagnostic> DiagnoseSchema(Connection& connection);

/// Throws StoreError (kCorrupt) with the first of DiagnoseSchema, if any.
void RequireIntact(Connection& connection);
/// As RequireIntact, but accepts missing and changed views.
void RequireIntactTables(Connection& connection);

/// Creates the tables of an empty file or upgrades those of an older one, and creates all views anew, in one
/// transaction: a process that ends meanwhile leaves the file as it was. Throws StoreError: the codes of Identify,
/// kCorrupt (the upgraded file does not have the current schema), and SQLite's errors.
void Migrate(Connection& connection);

/// Throws the errors of Migrate, and leaves the file as it is. An older file is intact if it can be upgraded.
void RequireUpgradable(Connection& connection);

}  // namespace legopt::db

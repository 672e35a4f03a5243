#include "db/migrations.h"

#include <algorithm>
#include <compare>
#include <set>
#include <string>
#include <vector>

#include "db/connection.h"

namespace legopt::db {

int SchemaVersion() { return Migrations().back().version; }

Identity Identify(Connection& connection, int newest) {
  const std::int64_t application = connection.QueryInt("PRAGMA application_id");
  Identity identity;
  identity.version = connection.QueryInt("PRAGMA user_version");
  identity.empty =
      application == 0 && identity.version == 0 && connection.QueryInt("SELECT count(*) FROM sqlite_schema") == 0;
  if (identity.empty) return identity;
  const std::string file = connection.path().string();
  if (application != kApplicationId) {
    throw StoreError(StoreErrorCode::kNotLegopt, file + ": this is the database of another program (application_id " +
                                                     std::to_string(application) + "); choose another file");
  }
  if (identity.version < 1) {
    throw StoreError(StoreErrorCode::kCorrupt, file + ": not an intact legopt database: its schema version is " +
                                                   std::to_string(identity.version) + "; restore a backup");
  }
  if (identity.version > newest) {
    throw StoreError(StoreErrorCode::kNewerSchema,
                     file + ": written by a newer legopt (schema " + std::to_string(identity.version) +
                         ", this program knows up to " + std::to_string(newest) + "); use that legopt or a newer one");
  }
  return identity;
}

namespace {

constexpr char kNotIntact[] = ": not an intact legopt database: ";

struct Entry {
  std::string type, name, table, sql;
  auto operator<=>(const Entry&) const = default;
};

struct Schema {
  std::vector<Entry> entries;
  std::vector<std::string> columns;  // e.g. "column 'state' of table 'jobs'"
};

// Returns all entries except SQLite's own tables and the indexes created for UNIQUE and PRIMARY KEY.
Schema SchemaOf(Connection& connection) {
  Schema schema;
  Statement entries(connection,
                    "SELECT type, name, tbl_name, sql FROM sqlite_schema WHERE sql IS NOT NULL AND NOT (type = 'table' "
                    "AND name IN ('sqlite_sequence', 'sqlite_stat1', 'sqlite_stat4')) ORDER BY 1, 2",
                    false);
  while (entries.Step()) {
    schema.entries.push_back(
        {entries.column_text(0), entries.column_text(1), entries.column_text(2), entries.column_text(3)});
  }
  Statement columns(connection,
                    "SELECT 'column ' || quote(c.name) || ' of table ' || quote(t.name) FROM sqlite_schema AS t, "
                    "pragma_table_xinfo(t.name) AS c WHERE t.type = 'table' AND t.name NOT GLOB 'sqlite_*'",
                    false);
  while (columns.Step()) schema.columns.push_back(columns.column_text(0));
  return schema;
}

// e.g. "table 'jobs'", "trigger 'results_stay'"
std::string Named(const Entry& entry) { return entry.type + " '" + entry.name + "'"; }

// Returns whether an entry that is not part of the schema changes legopt's reads or writes.
bool IsIntrusive(const Entry& entry, const std::vector<Entry>& schema) {
  if (entry.type == "trigger") return true;
  const bool has_its_name = std::any_of(schema.begin(), schema.end(), [&](const Entry& own) {
    return own.name == entry.name;  // a duplicate name, possible only in a modified sqlite_schema
  });
  const bool is_on_ours = std::any_of(schema.begin(), schema.end(),
                                      [&](const Entry& own) { return own.type == "table" && own.name == entry.table; });
  return has_its_name || (entry.type == "index" && is_on_ours && entry.sql.starts_with("CREATE UNIQUE"));
}

// Brings an empty or older database from its version to the last of `migrations`.
void Upgrade(Connection& connection, std::span<const Migration> migrations) {
  for (const Migration& migration : migrations) {
    Transaction transaction(connection);
    // Read again under the write lock: no other process can be migrating now.
    if (connection.QueryInt("PRAGMA user_version") >= migration.version) continue;
    connection.ExecuteUndefended(std::string(migration.sql));
    connection.Execute("PRAGMA application_id = " + std::to_string(kApplicationId));
    connection.Execute("PRAGMA user_version = " + std::to_string(migration.version));
    transaction.Commit();
  }
}

// Returns the schema of a version. The newest one is cached, because running all migrations takes longer than a check.
Schema SchemaOfVersion(std::int64_t version) {
  const auto make = [version] {
    Connection fresh(":memory:", Connection::Mode::kMemory);
    Upgrade(fresh, Migrations().first(static_cast<std::size_t>(version)));
    return SchemaOf(fresh);
  };
  if (version != SchemaVersion()) return make();
  static const Schema newest = make();
  return newest;
}

}  // namespace

std::vector<SchemaDiagnostic> DiagnoseSchema(Connection& connection, std::int64_t version) {
  using Kind = SchemaDiagnostic::Kind;
  const Schema found = SchemaOf(connection), schema = SchemaOfVersion(version);
  std::vector<SchemaDiagnostic> missing, others;
  const std::set<std::string> columns(found.columns.begin(), found.columns.end());
  const std::set<Entry> entries(found.entries.begin(), found.entries.end()),
      own(schema.entries.begin(), schema.entries.end());
  for (const Entry& entry : schema.entries) {
    if (entries.contains(entry)) continue;
    const bool changed = std::any_of(entries.begin(), entries.end(), [&](const Entry& other) {
      return other.type == entry.type && other.name == entry.name;
    });
    (changed ? others : missing).push_back({changed ? Kind::kChanged : Kind::kMissing, Named(entry)});
  }
  for (const std::string& column : schema.columns) {
    if (!columns.contains(column)) missing.push_back({Kind::kMissing, column});
  }
  for (const Entry& entry : found.entries) {
    if (own.contains(entry) || !IsIntrusive(entry, schema.entries)) continue;
    const bool changed = std::any_of(own.begin(), own.end(), [&](const Entry& other) {
      return other.type == entry.type && other.name == entry.name;
    });
    if (!changed) others.push_back({Kind::kForeign, Named(entry) + " on table '" + entry.table + "'"});
  }
  missing.insert(missing.end(), others.begin(), others.end());
  return missing;
}

void RequireIntact(Connection& connection, const Identity& identity) {
  const std::vector<SchemaDiagnostic> defects = DiagnoseSchema(connection, identity.version);
  if (defects.empty()) return;
  const SchemaDiagnostic& defect = defects.front();
  const std::string start = connection.path().string() + kNotIntact + defect.entry;
  switch (defect.kind) {
    case SchemaDiagnostic::Kind::kMissing:
      throw StoreError(StoreErrorCode::kCorrupt, start + " is missing; restore a backup");
    case SchemaDiagnostic::Kind::kChanged:
      throw StoreError(StoreErrorCode::kCorrupt, start + " is not that of schema version " +
                                                     std::to_string(identity.version) + "; restore a backup");
    case SchemaDiagnostic::Kind::kForeign:
      throw StoreError(StoreErrorCode::kCorrupt, start + " is not legopt's; restore a backup, or drop it");
  }
}

void Migrate(Connection& connection, std::span<const Migration> migrations) {
  Identify(connection, migrations.back().version);
  try {
    Upgrade(connection, migrations);
  } catch (const StoreError& error) {
    // The migrations are correct, so the schema must differ from its declared version.
    if (error.code() != StoreErrorCode::kBadQuery && error.code() != StoreErrorCode::kConstraint) throw;
    throw StoreError(StoreErrorCode::kCorrupt,
                     connection.path().string() + kNotIntact + "it cannot be upgraded from schema version " +
                         connection.QueryText("PRAGMA user_version") + " (" + error.what() + "); restore a backup");
  }
}

}  // namespace legopt::db

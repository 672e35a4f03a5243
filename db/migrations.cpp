#include "db/migrations.h"

#include <algorithm>
#include <charconv>
#include <compare>
#include <set>
#include <string>
#include <vector>

#include "db/connection.h"

namespace legopt::db {

namespace {

std::string_view WithoutSpace(std::string_view text) {
  constexpr std::string_view kSpace = " \n";
  const std::size_t begin = std::min(text.find_first_not_of(kSpace), text.size());
  return text.substr(begin, text.find_last_not_of(kSpace) + 1 - begin);
}

const std::vector<AddedColumn>& NewColumns() {
  static const std::vector<AddedColumn> columns = AddedColumns(Tables());
  return columns;
}

}  // namespace

std::vector<AddedColumn> AddedColumns(std::string_view tables) {
  constexpr std::string_view kTable = "CREATE TABLE ", kSince = "-- since ";
  std::vector<AddedColumn> columns;
  std::string table, definition;
  while (!tables.empty()) {
    const std::string_view line = tables.substr(0, tables.find('\n'));
    tables.remove_prefix(std::min(line.size() + 1, tables.size()));
    const std::size_t comment = std::min(line.find("--"), line.size());
    const std::string_view code = WithoutSpace(line.substr(0, comment));
    if (code.starts_with(kTable)) {
      table = WithoutSpace(code.substr(kTable.size(), code.find('(') - kTable.size()));
      definition.clear();
      continue;
    }
    if (line.starts_with(")")) table.clear();
    if (table.empty() || code.empty()) continue;
    definition += (definition.empty() ? "" : " ") + std::string(code);
    const bool added = line.substr(comment).starts_with(kSince);
    if (std::ranges::count(definition, '(') != std::ranges::count(definition, ')')) continue;
    if (code.ends_with(',')) {
      definition.pop_back();
    } else if (!added) {
      continue;
    }
    if (added) {
      const std::string_view version = line.substr(comment + kSince.size());
      AddedColumn& column = columns.emplace_back(AddedColumn{table, definition, 0});
      std::from_chars(version.data(), version.data() + version.size(), column.since);
    }
    definition.clear();
  }
  return columns;
}

int SchemaVersion() {
  int version = Upgrades().back().from + 1;
  for (const AddedColumn& column : NewColumns()) version = std::max(version, column.since);
  return version;
}

int OldestSchemaVersion() { return Upgrades().front().from; }

Identity Identify(Connection& connection) {
  const std::int64_t application = connection.QueryInt("PRAGMA application_id");
  Identity identity;
  identity.version = connection.QueryInt("PRAGMA user_version");
  identity.empty =
      application == 0 && identity.version == 0 && connection.QueryInt("SELECT count(*) FROM sqlite_schema") == 0;
  if (identity.empty) return identity;
  const std::string file = connection.path().string(), version = std::to_string(identity.version);
  if (application != kApplicationId) {
    throw StoreError(StoreErrorCode::kNotLegopt, file + ": this is the database of another program (application_id " +
                                                     std::to_string(application) + "); choose another file");
  }
  if (identity.version < 1) {
    throw StoreError(StoreErrorCode::kCorrupt,
                     file + ": not an intact legopt database: its schema version is " + version + "; restore a backup");
  }
  if (identity.version > SchemaVersion()) {
    throw StoreError(StoreErrorCode::kNewerSchema, file + ": written by a newer legopt (schema " + version +
                                                       ", this program knows up to " + std::to_string(SchemaVersion()) +
                                                       "); use that legopt or a newer one");
  }
  if (identity.version < OldestSchemaVersion()) {
    throw StoreError(
        StoreErrorCode::kOlderSchema,
        file + ": written by an old legopt (schema " + version + ", this program upgrades schema " +
            std::to_string(OldestSchemaVersion()) +
            " and newer); upgrade it first with an earlier legopt, built from sources of 24 to 27 November "
            "2026: start its legopt-server --db on the file once");
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

bool IsSpace(char c) { return std::string_view(" \t\n\r\f").find(c) != std::string_view::npos; }

bool IsWord(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
         static_cast<unsigned char>(c) >= 0x80 || std::string_view("_'\"`[]").find(c) != std::string_view::npos;
}

// Returns the length of the token at the start of `sql`: a quoted text, a comment or one character.
std::size_t TokenLength(std::string_view sql) {
  const auto up_to = [&](std::string_view end) {
    const std::size_t at = sql.find(end, 1);
    return at == std::string_view::npos ? sql.size() : at + end.size();
  };
  if (sql.starts_with("--")) return up_to("\n");
  if (sql.starts_with("/*")) return up_to("*/");
  switch (sql.front()) {
    case '\'':
    case '"':
    case '`':
      return up_to(sql.substr(0, 1));
    case '[':
      return up_to("]");
    default:
      return 1;
  }
}

// Returns SQL without comments, and with white space only where it separates words. python/legopt/read_only_file.py
// does the same.
std::string Normalized(std::string_view sql) {
  std::string text;
  bool space = false;
  while (!sql.empty()) {
    const std::string_view token = sql.substr(0, TokenLength(sql));
    sql.remove_prefix(token.size());
    if (IsSpace(token.front()) || token.starts_with("--") || token.starts_with("/*")) {
      space = true;
      continue;
    }
    if (space && !text.empty() && IsWord(text.back()) && IsWord(token.front())) text += ' ';
    space = false;
    text += token;
  }
  return text;
}

// Returns all entries except SQLite's own tables and the indexes created for UNIQUE and PRIMARY KEY.
Schema SchemaOf(Connection& connection) {
  Schema schema;
  Statement entries(connection,
                    "SELECT type, name, tbl_name, sql FROM sqlite_schema WHERE sql IS NOT NULL AND NOT (type = 'table' "
                    "AND name IN ('sqlite_sequence', 'sqlite_stat1', 'sqlite_stat4')) ORDER BY 1, 2",
                    false);
  while (entries.Step()) {
    schema.entries.push_back(
        {entries.column_text(0), entries.column_text(1), entries.column_text(2), Normalized(entries.column_text(3))});
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

const Schema& CurrentSchema() {
  static const Schema schema = [] {
    Connection fresh(":memory:", Connection::Mode::kMemory);
    fresh.Execute(std::string(Tables()));
    fresh.Execute(std::string(Views()));
    return SchemaOf(fresh);
  }();
  return schema;
}

// Throws the StoreError of a defect in a file of schema version `version`.
[[noreturn]] void ThrowNotIntact(Connection& connection, const SchemaDiagnostic& defect, std::int64_t version) {
  const std::string start = connection.path().string() + kNotIntact + defect.entry;
  const std::string advice =
      defect.view ? "; start legopt-server --db on it once, it restores the view" : "; restore a backup";
  switch (defect.kind) {
    case SchemaDiagnostic::Kind::kMissing:
      throw StoreError(StoreErrorCode::kCorrupt, start + " is missing" + advice);
    case SchemaDiagnostic::Kind::kChanged:
      throw StoreError(StoreErrorCode::kCorrupt,
                       start + " is not that of schema version " + std::to_string(version) + advice);
    case SchemaDiagnostic::Kind::kForeign:
      break;
  }
  throw StoreError(StoreErrorCode::kCorrupt, start + " is not legopt's; restore a backup, or drop it");
}

// To be called in a transaction.
void CreateOrUpgrade(Connection& connection) {
  // Read again under the write lock: no other process can be upgrading now.
  const std::int64_t version = Identify(connection).version;
  if (version == 0) connection.Execute(std::string(Tables()));
  for (auto from = static_cast<int>(version); from != 0 && from < SchemaVersion(); ++from) {
    for (const AddedColumn& column : NewColumns()) {
      if (column.since != from + 1) continue;
      connection.Execute("ALTER TABLE " + column.table + " ADD COLUMN " + column.definition);
    }
    for (const Upgrade& upgrade : Upgrades()) {
      if (upgrade.from == from) connection.ExecuteUndefended(std::string(upgrade.sql));
    }
  }
  connection.Execute(std::string(Views()));
  if (version == SchemaVersion()) return;
  connection.Execute("PRAGMA application_id = " + std::to_string(kApplicationId));
  connection.Execute("PRAGMA user_version = " + std::to_string(SchemaVersion()));
  // The upgrades are correct, so a difference was there before.
  if (const auto defects = DiagnoseSchema(connection); !defects.empty()) {
    ThrowNotIntact(connection, defects.front(), version);
  }
}

enum class End { kCommit, kRollBack };

void CreateOrUpgrade(Connection& connection, End end) {
  const std::int64_t version = Identify(connection).version;
  try {
    Transaction transaction(connection);
    CreateOrUpgrade(connection);
    if (end == End::kCommit) transaction.Commit();
  } catch (const StoreError& error) {
    // As above: the schema must differ from its declared version.
    if (error.code() != StoreErrorCode::kBadQuery && error.code() != StoreErrorCode::kConstraint) throw;
    throw StoreError(StoreErrorCode::kCorrupt,
                     connection.path().string() + kNotIntact + "it cannot be upgraded from schema version " +
                         std::to_string(version) + " (" + error.what() + "); restore a backup");
  }
}

}  // namespace

std::vector<SchemaDiagnostic> DiagnoseSchema(Connection& connection) {
  using Kind = SchemaDiagnostic::Kind;
  const Schema found = SchemaOf(connection);
  const Schema& schema = CurrentSchema();
  std::vector<SchemaDiagnostic> missing, others;
  const std::set<std::string> columns(found.columns.begin(), found.columns.end());
  const std::set<Entry> entries(found.entries.begin(), found.entries.end()),
      own(schema.entries.begin(), schema.entries.end());
  for (const Entry& entry : schema.entries) {
    if (entries.contains(entry)) continue;
    const bool changed = std::any_of(entries.begin(), entries.end(), [&](const Entry& other) {
      return other.type == entry.type && other.name == entry.name;
    });
    (changed ? others : missing)
        .push_back({changed ? Kind::kChanged : Kind::kMissing, Named(entry), entry.type == "view"});
  }
  for (const std::string& column : schema.columns) {
    if (!columns.contains(column)) missing.push_back({Kind::kMissing, column, false});
  }
  for (const Entry& entry : found.entries) {
    if (own.contains(entry) || !IsIntrusive(entry, schema.entries)) continue;
    const bool changed = std::any_of(own.begin(), own.end(), [&](const Entry& other) {
      return other.type == entry.type && other.name == entry.name;
    });
    if (!changed) others.push_back({Kind::kForeign, Named(entry) + " on table '" + entry.table + "'", false});
  }
  missing.insert(missing.end(), others.begin(), others.end());
  return missing;
}

void RequireIntact(Connection& connection) {
  const std::vector<SchemaDiagnostic> defects = DiagnoseSchema(connection);
  if (!defects.empty()) ThrowNotIntact(connection, defects.front(), SchemaVersion());
}

void RequireIntactTables(Connection& connection) {
  for (const SchemaDiagnostic& defect : DiagnoseSchema(connection)) {
    if (!defect.view) ThrowNotIntact(connection, defect, SchemaVersion());
  }
}

void Migrate(Connection& connection) { CreateOrUpgrade(connection, End::kCommit); }

void RequireUpgradable(Connection& connection) { CreateOrUpgrade(connection, End::kRollBack); }

}  // namespace legopt::db

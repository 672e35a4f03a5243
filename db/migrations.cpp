#include "db/migrations.h"

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

// "table 'jobs'", "column 'state' of table 'jobs'", "trigger 'results_stay'", ...
std::vector<std::string> ThingsIn(Connection& connection) {
  std::vector<std::string> things;
  Statement read(connection,
                 "SELECT type || ' ' || quote(name) FROM sqlite_schema WHERE name NOT GLOB 'sqlite_*' UNION ALL "
                 "SELECT 'column ' || quote(c.name) || ' of table ' || quote(t.name) FROM sqlite_schema AS t, "
                 "pragma_table_xinfo(t.name) AS c WHERE t.type = 'table' AND t.name NOT GLOB 'sqlite_*'",
                 false);
  while (read.Step()) things.push_back(read.column_text(0));
  return things;
}

// Brings an empty or older database from its version to the last of `migrations`.
void Upgrade(Connection& connection, std::span<const Migration> migrations) {
  for (const Migration& migration : migrations) {
    Transaction transaction(connection);
    // Read again under the write lock: nobody else can be migrating now.
    if (connection.QueryInt("PRAGMA user_version") >= migration.version) continue;
    connection.ExecuteUndefended(std::string(migration.sql));
    connection.Execute("PRAGMA application_id = " + std::to_string(kApplicationId));
    connection.Execute("PRAGMA user_version = " + std::to_string(migration.version));
    transaction.Commit();
  }
}

// What a database of this version has. Of the newest it is made once: all migrations take longer than a check.
std::vector<std::string> ThingsOf(std::int64_t version) {
  const auto make = [version] {
    Connection fresh(":memory:", Connection::Mode::kMemory);
    Upgrade(fresh, Migrations().first(static_cast<std::size_t>(version)));
    return ThingsIn(fresh);
  };
  if (version != SchemaVersion()) return make();
  static const std::vector<std::string> newest = make();
  return newest;
}

}  // namespace

void RequireIntact(Connection& connection, const Identity& identity) {
  const std::vector<std::string> found = ThingsIn(connection);
  const std::set<std::string> there(found.begin(), found.end());
  for (const std::string& thing : ThingsOf(identity.version)) {
    if (there.contains(thing)) continue;
    throw StoreError(StoreErrorCode::kCorrupt,
                     connection.path().string() + kNotIntact + thing + " is missing; restore a backup");
  }
}

void Migrate(Connection& connection, std::span<const Migration> migrations) {
  Identify(connection, migrations.back().version);
  try {
    Upgrade(connection, migrations);
  } catch (const StoreError& error) {
    // The steps are right, so what they met is not what the version promises.
    if (error.code() != StoreErrorCode::kBadQuery && error.code() != StoreErrorCode::kConstraint) throw;
    throw StoreError(StoreErrorCode::kCorrupt,
                     connection.path().string() + kNotIntact + "it cannot be upgraded from schema version " +
                         connection.QueryText("PRAGMA user_version") + " (" + error.what() + "); restore a backup");
  }
}

}  // namespace legopt::db

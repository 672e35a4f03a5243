#include "db/migrations.h"

#include <string>

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
  if (identity.version > newest) {
    throw StoreError(StoreErrorCode::kNewerSchema,
                     file + ": written by a newer legopt (schema " + std::to_string(identity.version) +
                         ", this program knows up to " + std::to_string(newest) + "); use that legopt or a newer one");
  }
  return identity;
}

void Migrate(Connection& connection, std::span<const Migration> migrations) {
  Identify(connection, migrations.back().version);
  for (const Migration& migration : migrations) {
    Transaction transaction(connection);
    // Read again under the write lock: nobody else can be migrating now.
    if (connection.QueryInt("PRAGMA user_version") >= migration.version) continue;
    connection.Execute(std::string(migration.sql));
    connection.Execute("PRAGMA application_id = " + std::to_string(kApplicationId));
    connection.Execute("PRAGMA user_version = " + std::to_string(migration.version));
    transaction.Commit();
  }
}

}  // namespace legopt::db

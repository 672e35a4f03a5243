#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace legopt::db {

class Connection;

/// One rule that a database breaks.
struct Defect {
  std::string rule;         ///< lower_snake name of the rule, e.g. "done_has_result"
  std::string detail;       ///< a sentence for humans, naming the first offender
  std::int64_t places = 1;  ///< rows that break it; for "integrity" at most 20 are looked for
};

/// Names of all rules, in the order in which they are checked.
std::vector<std::string> AuditRules();

/// Checks everything that a legopt database promises: the file (SQLite's integrity check, which covers CHECKs, NOT
/// NULL, types and indexes; foreign keys), the schema (no trigger, view, index or table missing or changed), and what
/// spans rows: one accepted result per done job and none elsewhere, attempts counted and numbered without gaps, one
/// owner per leased job, results of finished attempts, closed experiments without open jobs, totals that agree,
/// waypoints without gaps. Empty when all is well.
///
/// Looks at a copy in the temporary folder (TMPDIR), gone at the end: a live database is seen at one commit and read
/// only as long as copying takes, and SQLite does not even parse CHECKs on a read-only connection, so would not check
/// them.
///
/// Throws StoreError: as ReadOnlyDatabase, kFull when the copy does not fit, and what SQLite reports when the file is
/// too damaged to be read.
std::vector<Defect> Audit(const std::filesystem::path& file);

/// The rules about the file alone; for databases of any schema version.
std::vector<Defect> AuditFile(Connection& connection);

}  // namespace legopt::db

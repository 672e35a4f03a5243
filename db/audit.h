#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace legopt::db {

class Connection;

/// A violation of one database rule.
struct AuditDiagnostic {
  std::string rule;         ///< lower_snake name of the rule, e.g. "done_has_result"
  std::string detail;       ///< a sentence for the user; names the first offending row
  std::int64_t places = 1;  ///< number of violating rows; the "integrity" check stops after 20
};

/// Names of all rules, in the order in which they are checked.
std::vector<std::string> AuditRules();

/// Checks all invariants of a legopt database: the file (SQLite's integrity check, which covers CHECKs, NOT NULL, types
/// and indexes; foreign keys), the schema (no trigger, view, index or table missing or changed), and invariants across
/// rows: exactly one accepted result per done job and none for other jobs, attempts counted and numbered without gaps,
/// one owner per leased job, results only of finished attempts, no open jobs in closed experiments, consistent totals,
/// waypoints without gaps. Returns an empty vector if no rule is violated.
///
/// Checks a temporary copy (in TMPDIR, removed at the end) for two reasons: a live database is seen at a single commit
/// and read only while it is copied, and SQLite does not parse, and so does not check, CHECKs on a read-only
/// connection.
///
/// Throws files::FileError if the copy cannot be created: nothing was checked. Throws StoreError: the codes of
/// ReadOnlyDatabase, kFull if the copy does not fit, and SQLite's error if the file is too damaged to be read.
std::vector<AuditDiagnostic> Audit(const std::filesystem::path& file);

/// Checks only the rules about the file; works for databases of any schema version.
std::vector<AuditDiagnostic> AuditFile(Connection& connection);

}  // namespace legopt::db

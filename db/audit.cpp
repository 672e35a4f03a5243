#include "db/audit.h"

#include <unistd.h>

#include <array>
#include <iterator>
#include <memory>
#include <string_view>

#include "db/connection.h"
#include "db/foreign_keys.h"
#include "db/migrations.h"
#include "db/read_only_database.h"
#include "legopt/files/temporary_folder.h"

namespace legopt::db {
namespace {

// Each statement returns one row per violation; its first column names the offending row.
struct Rule {
  std::string_view name;
  std::string_view meaning;  // message that ends with the first offending row
  std::string_view sql;
};

constexpr std::array kRules{
    Rule{"done_has_result", "a job is done without its accepted result: job ",
         "SELECT job_id FROM jobs WHERE state = 'done' AND job_id NOT IN (SELECT job_id FROM results)"},
    Rule{"result_is_of_done_job", "an accepted result belongs to a job that is not done: job ",
         "SELECT r.job_id FROM results AS r LEFT JOIN jobs AS j USING (job_id) WHERE j.state IS NOT 'done'"},
    Rule{"result_is_of_last_finished_attempt", "a result is not of its job's last attempt, finished: job ",
         "SELECT r.job_id FROM results AS r JOIN jobs AS j USING (job_id) LEFT JOIN attempts AS a "
         "ON a.job_id = r.job_id AND a.attempt = r.attempt "
         "WHERE r.attempt <> j.attempts OR a.outcome IS NOT 'finished'"},
    Rule{"finished_attempt_has_result", "an attempt has finished, but its job has no result of it: job ",
         "SELECT a.job_id FROM attempts AS a LEFT JOIN results AS r ON r.job_id = a.job_id AND r.attempt = a.attempt "
         "WHERE a.outcome = 'finished' AND r.job_id IS NULL AND NOT EXISTS (SELECT 1 FROM stale_results AS s WHERE "
         "s.job_id = a.job_id AND s.attempt = a.attempt AND s.solver_status = 'time_limit')"},
    Rule{"attempts_are_counted", "the count of attempts is not the number of leases recorded: job ",
         "SELECT j.job_id FROM jobs AS j LEFT JOIN (SELECT job_id, count(*) AS n, max(attempt) AS last FROM attempts "
         "GROUP BY job_id) AS a USING (job_id) WHERE j.attempts <> coalesce(a.n, 0) OR j.attempts <> coalesce(a.last, "
         "0)"},
    // A retry counts all previous attempts as returned; attempts that were returned after it are added.
    Rule{
        "returned_attempts_are_counted", "the count of returned attempts differs from the record: job ",
        "SELECT j.job_id FROM jobs AS j LEFT JOIN (SELECT job_id, count(*) AS n FROM attempts WHERE outcome = "
        "'returned' GROUP BY job_id) AS a USING (job_id) WHERE j.returned <> coalesce(a.n, 0) AND NOT EXISTS (SELECT 1 "
        "FROM attempts AS k WHERE k.job_id = j.job_id AND j.returned = k.attempt + (SELECT count(*) FROM attempts AS b "
        "WHERE b.job_id = j.job_id AND b.attempt > k.attempt AND b.outcome = 'returned'))"},
    Rule{"attempts_stay_within_maximum", "more attempts were charged than allowed: job ",
         "SELECT job_id FROM jobs WHERE attempts - returned > max_attempts"},
    Rule{"leased_job_has_owner", "a job is leased without a running attempt: job ",
         "SELECT job_id FROM jobs AS j WHERE state = 'leased' AND NOT EXISTS (SELECT 1 FROM attempts AS a WHERE "
         "a.job_id = j.job_id AND a.attempt = j.attempts AND a.outcome = 'running')"},
    Rule{"running_attempt_is_of_leased_job", "an attempt is running, but its job is not leased: job ",
         "SELECT a.job_id FROM attempts AS a LEFT JOIN jobs AS j USING (job_id) WHERE a.outcome = 'running' AND "
         "(j.state IS NOT 'leased' OR a.attempt <> j.attempts)"},
    Rule{"tokens_are_unique", "two leases have the same token: token ",
         "SELECT token FROM attempts GROUP BY token HAVING count(*) > 1"},
    Rule{"closed_experiment_has_no_open_job", "an experiment is over with jobs queued or leased: experiment ",
         "SELECT DISTINCT e.experiment_id FROM experiments AS e JOIN cells AS c USING (experiment_id) JOIN jobs AS j "
         "USING (cell_id) WHERE e.state <> 'active' AND j.state IN ('queued', 'leased')"},
    Rule{
        "experiment_has_its_jobs", "the jobs of an experiment are not those it was made with: experiment ",
        "SELECT e.experiment_id FROM experiments AS e LEFT JOIN (SELECT c.experiment_id, count(*) AS n, min(j.job_id) "
        "AS first, max(j.job_id) AS last FROM cells AS c JOIN jobs AS j USING (cell_id) GROUP BY c.experiment_id) AS a "
        "USING (experiment_id) WHERE e.num_jobs IS NOT a.n OR e.first_job_id IS NOT a.first OR "
        "e.first_job_id + e.num_jobs - 1 IS NOT a.last"},
    Rule{"cell_has_its_jobs", "the jobs of a cell are not as many as it was made with: cell ",
         "SELECT c.cell_id FROM cells AS c LEFT JOIN (SELECT cell_id, count(*) AS n FROM jobs GROUP BY cell_id) AS a "
         "USING (cell_id) WHERE c.num_jobs IS NOT a.n"},
    Rule{"tasks_of_cell_and_problem_agree", "a job's problem is of another task than its cell: job ",
         "SELECT j.job_id FROM jobs AS j JOIN cells AS c USING (cell_id) JOIN problems AS p USING (problem_key) WHERE "
         "c.task <> p.task"},
    Rule{"result_is_in_cell_of_job", "a result counts in another cell than its job's: job ",
         "SELECT r.job_id FROM results AS r JOIN jobs AS j USING (job_id) WHERE r.cell_id <> j.cell_id"},
    Rule{"results_are_counted", "a worker's results of an experiment are not as many as counted: experiment ",
         "SELECT experiment_id FROM (SELECT experiment_id, worker_id, results FROM result_workers WHERE results > 0 "
         "UNION ALL SELECT c.experiment_id, a.worker_id, count(*) FROM results AS r JOIN cells AS c USING (cell_id) "
         "JOIN attempts AS a ON a.job_id = r.job_id AND a.attempt = r.attempt GROUP BY 1, 2) "
         "GROUP BY experiment_id, worker_id HAVING count(*) <> 2 OR min(results) <> max(results)"},
    Rule{"results_of_cells_are_counted", "the counted results of a cell are not its results: cell ",
         "SELECT c.cell_id FROM cells AS c LEFT JOIN cell_results AS k USING (cell_id) LEFT JOIN (SELECT cell_id, "
         "count(*) AS results, count(*) FILTER (WHERE verdict_literal = 'success') AS literal, "
         "count(*) FILTER (WHERE verdict_strict = 'success') AS strict, "
         "count(*) FILTER (WHERE verdict_solid = 'success') AS solid, "
         "count(*) FILTER (WHERE verdict_physical = 'success') AS physical, "
         "count(*) - count(verdict_solid) AS unjudged_solid, count(*) - count(verdict_physical) AS unjudged_physical "
         "FROM results GROUP BY cell_id) AS r USING (cell_id) WHERE (k.results, k.solved_literal, k.solved_strict, "
         "k.solved_solid, k.solved_physical, k.unjudged_solid, k.unjudged_physical) IS NOT (coalesce(r.results, 0), "
         "coalesce(r.literal, 0), coalesce(r.strict, 0), coalesce(r.solid, 0), coalesce(r.physical, 0), "
         "coalesce(r.unjudged_solid, 0), coalesce(r.unjudged_physical, 0))"},
    Rule{"taken_result_is_of_an_equal_job", "a result was reused from a job that is not identical: job ",
         "SELECT j.job_id FROM jobs AS j JOIN jobs AS s ON s.job_id = j.taken_from JOIN cells AS c ON c.cell_id = "
         "j.cell_id JOIN cells AS k ON k.cell_id = s.cell_id JOIN methods AS m ON m.method_id = c.method_id JOIN "
         "methods AS o ON o.method_id = k.method_id JOIN experiments AS e ON e.experiment_id = c.experiment_id JOIN "
         "experiments AS f ON f.experiment_id = k.experiment_id WHERE s.state <> 'done' OR s.taken_from IS NOT NULL OR "
         "j.problem_key <> s.problem_key OR j.repetition <> s.repetition OR c.initialization <> k.initialization OR "
         "c.effort_limit IS NOT k.effort_limit OR m.hash <> o.hash OR e.seed <> f.seed"},
    Rule{"taken_result_is_that_of_the_solve", "a reused result differs from the solved one: job ",
         "SELECT j.job_id FROM jobs AS j JOIN results AS r ON r.job_id = j.job_id JOIN results AS s ON s.job_id = "
         "j.taken_from JOIN attempts AS a ON a.job_id = r.job_id AND a.attempt = r.attempt JOIN attempts AS b ON "
         "b.job_id = s.job_id AND b.attempt = s.attempt WHERE a.worker_id <> b.worker_id OR r.wall_us <> s.wall_us OR "
         "r.solver_status <> s.solver_status OR r.iterations <> s.iterations OR r.verdict_literal <> s.verdict_literal "
         "OR r.cost IS NOT s.cost OR (SELECT count(*) FROM waypoints AS w WHERE w.job_id = r.job_id) <> (SELECT "
         "count(*) FROM waypoints AS w WHERE w.job_id = s.job_id) OR (SELECT count(*) FROM unsolved_waypoints AS w "
         "WHERE w.job_id = r.job_id) <> (SELECT count(*) FROM unsolved_waypoints AS w WHERE w.job_id = s.job_id) OR "
         "(SELECT count(*) FROM violations AS v WHERE v.job_id = r.job_id) <> (SELECT count(*) FROM violations AS v "
         "WHERE v.job_id = s.job_id)"},
    Rule{"waypoints_have_no_gaps", "waypoints are missing or of different sizes: job ",
         "SELECT job_id FROM waypoints GROUP BY job_id HAVING count(*) <> max(waypoint) + 1 OR "
         "min(length(x)) <> max(length(x))"},
    Rule{"unsolved_waypoints_have_no_gaps", "waypoints of an unsolved window are missing or of different sizes: job ",
         "SELECT job_id FROM unsolved_waypoints GROUP BY job_id HAVING count(*) <> max(waypoint) - min(waypoint) + 1 "
         "OR min(length(x)) <> max(length(x))"},
    Rule{"unsolved_waypoints_are_of_an_unsolved_window", "a result without an unsolved window has its waypoints: job ",
         "SELECT DISTINCT r.job_id FROM unsolved_waypoints JOIN results AS r USING (job_id) WHERE r.verdict_literal <> "
         "'window_unsolved'"},
    Rule{"times_are_in_order", "an attempt ended before it began: job ",
         "SELECT job_id FROM attempts WHERE ended_at_us < leased_at_us"},
};

class TemporaryFile {
 public:
  TemporaryFile() : path_(files::CreateTemporaryFile("legopt-audit-")) {}
  ~TemporaryFile() {
    for (const char* suffix : {"", "-journal", "-wal", "-shm"}) ::unlink((path_.string() + suffix).c_str());
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

void CheckIntegrity(Connection& connection, std::vector<AuditDiagnostic>& defects) {
  Statement check(connection, "PRAGMA integrity_check(20)", false);
  AuditDiagnostic defect{"integrity", "", 0};
  while (check.Step()) {
    const std::string line = check.column_text(0);
    if (line == "ok") continue;
    if (defect.places++ == 0) defect.detail = "the file is damaged: " + line;
  }
  if (defect.places > 0) defects.push_back(std::move(defect));
}

void CheckForeignKeys(Connection& connection, std::vector<AuditDiagnostic>& defects) {
  BrokenForeignKeys broken = FindBrokenForeignKeys(connection);
  if (broken.rows > 0) defects.push_back({"foreign_keys", std::move(broken.first), broken.rows});
}

void CheckSchema(Connection& connection, std::vector<AuditDiagnostic>& defects) {
  const std::vector<SchemaDiagnostic> found = DiagnoseSchema(connection);
  if (found.empty()) return;
  const bool foreign = found.front().kind == SchemaDiagnostic::Kind::kForeign;
  defects.push_back(
      {"schema", (foreign ? "not legopt's: " : "missing or changed: ") + found.front().entry, std::ssize(found)});
}

void CheckRule(Connection& connection, const Rule& rule, std::vector<AuditDiagnostic>& defects) {
  AuditDiagnostic defect{std::string(rule.name), "", 0};
  try {
    Statement check(connection, rule.sql, false);
    while (check.Step()) {
      if (defect.places++ == 0) defect.detail = std::string(rule.meaning) + check.column_text(0);
    }
  } catch (const StoreError& error) {
    // A table may be missing (the "schema" rule reports that), or pages may be damaged.
    if (error.code() != StoreErrorCode::kCorrupt && error.code() != StoreErrorCode::kBadQuery) throw;
    defect = {defect.rule, "cannot be checked, the file is too damaged", 1};
  }
  if (defect.places > 0) defects.push_back(std::move(defect));
}

}  // namespace

std::vector<std::string> AuditRules() {
  std::vector<std::string> names = {"integrity", "foreign_keys", "schema"};
  for (const Rule& rule : kRules) names.emplace_back(rule.name);
  return names;
}

std::vector<AuditDiagnostic> AuditFile(Connection& connection) {
  std::vector<AuditDiagnostic> defects;
  CheckIntegrity(connection, defects);
  CheckForeignKeys(connection, defects);
  return defects;
}

namespace {

std::vector<AuditDiagnostic> AuditThrough(const std::filesystem::path& file, const std::filesystem::path& temporary) {
  Connection copy(temporary, Connection::Mode::kReadWriteCreate);
  // The copy is discarded after a crash, so durability is not needed.
  copy.Execute("PRAGMA synchronous = OFF; PRAGMA journal_mode = OFF");
  {
    const std::unique_ptr<Connection> live = OpenForReading(file);
    RequireCurrentVersion(*live);
    copy.CopyFrom(*live);
  }
  copy.Execute("PRAGMA journal_mode = DELETE");
  std::vector<AuditDiagnostic> defects = AuditFile(copy);
  CheckSchema(copy, defects);
  for (const Rule& rule : kRules) CheckRule(copy, rule, defects);
  return defects;
}

}  // namespace

std::vector<AuditDiagnostic> Audit(const std::filesystem::path& file) {
  const TemporaryFile temporary;
  try {
    return AuditThrough(file, temporary.path());
  } catch (const StoreError& error) {
    // Report the user's file instead of the temporary copy, except if the temporary folder is full.
    std::string message = error.what();
    const std::string hidden = temporary.path().string();
    if (error.code() == StoreErrorCode::kFull || !message.starts_with(hidden)) throw;
    throw StoreError(error.code(), message.replace(0, hidden.size(), file.string()));
  }
}

}  // namespace legopt::db

#pragma once

#include <cstddef>
#include <string>

#include "db/connection.h"
#include "db/result_record.h"

// SQL statements of SqliteStore, one constant each. The result columns are generated from kResultColumns. Private to
// the sqlite_store*.cpp files.

namespace legopt::db::sql {

inline constexpr char kLeaseJob[] =
    "UPDATE jobs SET state = 'leased', attempts = ?2 "
    "WHERE job_id = ?1 AND state = 'queued' AND attempts = ?2 - 1";

inline constexpr char kInsertAttempt[] =
    "INSERT INTO attempts (job_id, attempt, token, worker_id, leased_at_us) "
    "VALUES (?1, ?2, ?3, ?4, ?5)";

inline constexpr char kEndAttempt[] =
    "UPDATE attempts SET outcome = ?3, exit_signal = nullif(?4, 0), message = ?5, log_tail = ?6, "
    "ended_at_us = ?7 WHERE job_id = ?1 AND attempt = ?2 AND outcome = 'running'";

inline constexpr char kEndJob[] =
    "UPDATE jobs SET state = ?3, returned = returned + ?4 "
    "WHERE job_id = ?1 AND state = 'leased' AND attempts = ?2";

enum class Columns { kAll, kStale };

// Calls `visit` with each column of the record that is in the table.
template <class Visit>
void ForEach(Columns columns, const Visit& visit) {
  ForEachResultColumn([&](const auto& column) {
    if (columns == Columns::kAll || column.also_stale) visit(column);
  });
}

inline std::string Names(Columns columns) {
  std::string names;
  ForEach(columns, [&names](const auto& column) { names += (names.empty() ? "" : ", ") + std::string(column.name); });
  return names;
}

// Returns the parameters of these columns; `first` is the number of the first one.
inline std::string Parameters(Columns columns, int first) {
  std::string parameters;
  ForEach(columns, [&](const auto&) { parameters += (parameters.empty() ? "?" : ", ?") + std::to_string(first++); });
  return parameters;
}

// Binds the columns of the record starting at parameter `first`; returns the next free number.
inline int Bind(Statement& statement, int first, Columns columns, const ResultRecord& record) {
  ForEach(columns, [&](const auto& column) {
    if (column.is_null != nullptr && column.is_null(record)) {
      statement.BindNull(first++);
    } else {
      statement.Bind(first++, record.*column.member);
    }
  });
  return first;
}

inline constexpr int kFirstOfResult = 4;  // parameter number of the first result column

inline std::string InsertResult() {
  return "INSERT INTO results (job_id, cell_id, attempt, received_at_us, " + Names(Columns::kAll) +
         ") VALUES (?1, (SELECT cell_id FROM jobs WHERE job_id = ?1), ?2, ?3, " +
         Parameters(Columns::kAll, kFirstOfResult) + ")";
}

inline constexpr char kInsertUnsolved[] = "INSERT INTO unsolved_waypoints (job_id, waypoint, x) VALUES (?1, ?2, ?3)";

inline constexpr char kInsertViolation[] =
    "INSERT INTO violations (job_id, check_name, rule, waypoint, subject, value) "
    "VALUES (?1, ?2, ?3, nullif(?4, -1), ?5, ?6)";

inline constexpr char kInsertWaypoint[] = "INSERT INTO waypoints (job_id, waypoint, x) VALUES (?1, ?2, ?3)";

// Reuses the result of job ?2, in several steps. If there is no such result, the first step changes nothing.
inline constexpr char kTakeJob[] =
    "UPDATE jobs SET state = 'leased', attempts = 1, taken_from = (SELECT coalesce(s.taken_from, s.job_id) "
    "FROM jobs AS s WHERE s.job_id = ?2) WHERE job_id = ?1 AND state = 'queued' AND attempts = 0 "
    "AND EXISTS (SELECT 1 FROM results WHERE job_id = ?2)";

inline constexpr char kTakeAttempt[] =
    "INSERT INTO attempts (job_id, attempt, token, worker_id, leased_at_us) SELECT ?1, 1, ?3, a.worker_id, ?4 "
    "FROM results AS r JOIN attempts AS a ON a.job_id = r.job_id AND a.attempt = r.attempt WHERE r.job_id = ?2";

inline std::string TakeResultOf() {
  const std::string names = Names(Columns::kAll);
  return "INSERT INTO results (job_id, cell_id, attempt, received_at_us, " + names +
         ") SELECT ?1, (SELECT cell_id FROM jobs WHERE job_id = ?1), 1, ?3, " + names +
         " FROM results WHERE job_id = ?2";
}

inline constexpr char kTakeWaypoints[] =
    "INSERT INTO waypoints (job_id, waypoint, x) SELECT ?1, waypoint, x FROM waypoints WHERE job_id = ?2";

inline constexpr char kTakeUnsolved[] =
    "INSERT INTO unsolved_waypoints (job_id, waypoint, x) SELECT ?1, waypoint, x FROM unsolved_waypoints "
    "WHERE job_id = ?2";

inline constexpr char kTakeViolations[] =
    "INSERT INTO violations (job_id, check_name, rule, waypoint, subject, value) "
    "SELECT ?1, check_name, rule, waypoint, subject, value FROM violations WHERE job_id = ?2";

// Experiments that may contain results of identical jobs, in the order of their jobs. This filters once for many jobs:
// of thousands of experiments that solved the same jobs, most are excluded here.
inline constexpr char kFindEqualExperiments[] =
    "SELECT DISTINCT e.experiment_id FROM methods AS m JOIN cells AS c ON c.method_id = m.method_id "
    "JOIN experiments AS e ON e.experiment_id = c.experiment_id JOIN datasets AS d ON d.dataset_id = e.dataset_id "
    "WHERE m.hash = ?1 AND d.hash = ?2 AND c.task = ?3 AND c.initialization = ?4 AND e.seed = ?5 "
    "AND c.effort_limit IS nullif(?6, 0) AND e.experiment_id <> ?7 AND EXISTS (SELECT 1 FROM result_workers AS s "
    "JOIN workers AS w ON w.worker_id = s.worker_id WHERE s.experiment_id = e.experiment_id AND s.results > 0 "
    "AND ?8 IN ('', w.build_id)) ORDER BY e.experiment_id";

inline constexpr char kFindKnownResult[] =
    "SELECT job_id, wall_us, CASE ?11 WHEN 'literal' THEN verdict_literal WHEN 'strict' THEN verdict_strict "
    "WHEN 'solid' THEN verdict_solid ELSE verdict_physical END = 'success' FROM reusable_results WHERE experiment_id = "
    "?1 AND method_hash = ?2 "
    "AND task = ?3 AND initialization = ?4 AND effort_limit IS nullif(?5, 0) AND wall_us <= ?6 "
    "AND peak_memory_bytes <= ?7 AND ?8 IN ('', build_id) AND problem_id = ?9 AND repetition = ?10 "
    "ORDER BY job_id LIMIT 1";

inline constexpr int kFirstOfStale = 9;  // parameter number of the first result column

inline std::string InsertStale() {
  return "INSERT INTO stale_results (job_id, attempt, outcome, reason, message, received_at_us, waypoint_size, x, " +
         Names(Columns::kStale) + ") VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, " +
         Parameters(Columns::kStale, kFirstOfStale) + ") ON CONFLICT (job_id, attempt) DO NOTHING";
}

inline constexpr char kCancelAttempts[] =
    "UPDATE attempts SET outcome = 'cancelled', ended_at_us = ?2 "
    "WHERE outcome = 'running' AND job_id IN (SELECT j.job_id FROM experiments AS e JOIN jobs AS j "
    "ON j.job_id >= e.first_job_id AND j.job_id < e.first_job_id + e.num_jobs "
    "WHERE e.experiment_id = ?1 AND j.state = 'leased')";

inline constexpr char kCancelJobs[] =
    "UPDATE jobs SET state = 'cancelled' WHERE state IN ('queued', 'leased') "
    "AND cell_id IN (SELECT cell_id FROM cells WHERE experiment_id = ?1)";

// The column `hold` has the word 'held' for a pause with a reason.
inline constexpr char kControlExperiment[] =
    "UPDATE experiments SET hold = iif(?2 = 'paused' AND ?3 <> '', 'held', ?2), hold_reason = ?3, priority = ?4, "
    "builds = ?5, build_id = nullif(?6, '') "
    "WHERE experiment_id = ?1 AND state = 'active'";

inline constexpr char kRetryJobs[] =
    "UPDATE jobs SET state = 'queued', returned = attempts WHERE state IN ('failed', 'dead') "
    "AND cell_id IN (SELECT cell_id FROM cells WHERE experiment_id = ?1)";

inline constexpr char kTimeLimitedResults[] =
    "SELECT r.job_id FROM results AS r JOIN cells AS c USING (cell_id) "
    "WHERE c.experiment_id = ?1 AND r.solver_status = 'time_limit'";

inline std::string KeepResultAsStale() {
  const std::string names = Names(Columns::kStale);
  return "INSERT OR REPLACE INTO stale_results (job_id, attempt, outcome, reason, message, received_at_us, "
         "waypoint_size, x, " +
         names +
         ") SELECT job_id, attempt, 'finished', "
         "'the time limit ended it, and the job was queued again', '', ?2, ?3, ?4, " +
         names + " FROM results WHERE job_id = ?1";
}

inline constexpr char kReadWaypoints[] = "SELECT x FROM waypoints WHERE job_id = ?1 ORDER BY waypoint";

inline constexpr char kDropResult[] = "DELETE FROM results WHERE job_id = ?1";

inline constexpr char kDropWaypoints[] = "DELETE FROM waypoints WHERE job_id = ?1";

inline constexpr char kDropUnsolved[] = "DELETE FROM unsolved_waypoints WHERE job_id = ?1";

inline constexpr char kDropViolations[] = "DELETE FROM violations WHERE job_id = ?1";

inline constexpr char kRequeueDone[] =
    "UPDATE jobs SET state = 'queued', returned = attempts WHERE job_id = ?1 AND state = 'done'";

inline constexpr char kRememberDeletedIds[] =
    "INSERT INTO deleted_ids SELECT 'experiment', max(experiment_id) FROM experiments UNION ALL "
    "SELECT 'job', max(job_id) FROM jobs UNION ALL SELECT 'cell', max(cell_id) FROM cells WHERE true "
    "ON CONFLICT (kind) DO UPDATE SET largest = max(largest, excluded.largest)";

inline constexpr char kJobsOfClosed[] =
    "SELECT first_job_id, first_job_id + num_jobs FROM experiments WHERE experiment_id = ?1 AND state <> 'active'";

inline constexpr char kDeleteExperiment[] = "DELETE FROM experiments WHERE experiment_id = ?1";

// Statements that delete dependent rows: those of the jobs ?1 <= job_id < ?2, and those of the experiment.
inline constexpr const char* kDeleteOfJobs[] = {"DELETE FROM events WHERE job_id >= ?1 AND job_id < ?2",
                                                "DELETE FROM waypoints WHERE job_id >= ?1 AND job_id < ?2",
                                                "DELETE FROM unsolved_waypoints WHERE job_id >= ?1 AND job_id < ?2",
                                                "DELETE FROM violations WHERE job_id >= ?1 AND job_id < ?2",
                                                "DELETE FROM results WHERE job_id >= ?1 AND job_id < ?2",
                                                "DELETE FROM stale_results WHERE job_id >= ?1 AND job_id < ?2",
                                                "DELETE FROM attempts WHERE job_id >= ?1 AND job_id < ?2",
                                                "DELETE FROM jobs WHERE job_id >= ?1 AND job_id < ?2"};
inline constexpr const char* kDeleteOfExperiment[] = {
    "DELETE FROM cell_results WHERE cell_id IN (SELECT cell_id FROM cells WHERE experiment_id = ?1)",
    "DELETE FROM cells WHERE experiment_id = ?1",
    "DELETE FROM experiment_tags WHERE experiment_id = ?1",
    "DELETE FROM result_workers WHERE experiment_id = ?1",
    "DELETE FROM events WHERE experiment_id = ?1",
    "DELETE FROM dataset_archives WHERE ?1 > 0 AND dataset_id NOT IN (SELECT dataset_id FROM experiments)"};

inline constexpr char kRenameExperiment[] = "UPDATE experiments SET name = ?2 WHERE experiment_id = ?1";

inline constexpr char kSetTag[] =
    "INSERT INTO experiment_tags (experiment_id, tag) VALUES (?1, ?2) ON CONFLICT (experiment_id, tag) DO NOTHING";

inline constexpr char kDropTag[] = "DELETE FROM experiment_tags WHERE experiment_id = ?1 AND tag = ?2";

inline constexpr char kReopenExperiment[] =
    "UPDATE experiments SET state = 'active', finished_at_us = NULL WHERE experiment_id = ?1 AND state <> 'cancelled'";

inline constexpr char kCloseExperiment[] =
    "UPDATE experiments SET state = ?2, finished_at_us = ?3, hold = 'none', hold_reason = '' "
    "WHERE experiment_id = ?1 AND state = 'active'";

inline constexpr char kPutWorker[] =
    "INSERT INTO workers (worker_id, endpoint, name, hostname, pid, slots, build, first_seen_at_us, last_seen_at_us, "
    "build_id, processor, processors, memory_bytes, load) "
    "VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?8, nullif(?9, ''), ?10, nullif(?11, 0), nullif(?12, 0), ?13) "
    "ON CONFLICT (worker_id) DO UPDATE SET endpoint = ?2, name = ?3, hostname = ?4, pid = ?5, slots = ?6, build = ?7, "
    "last_seen_at_us = ?8, build_id = nullif(?9, ''), processor = ?10, processors = nullif(?11, 0), "
    "memory_bytes = nullif(?12, 0), load = ?13";

inline constexpr char kInsertEvent[] =
    "INSERT INTO events (kind, at_us, experiment_id, job_id, worker_id, detail) "
    "VALUES (?1, ?2, ?3, ?4, ?5, ?6)";

inline constexpr char kInsertArchive[] =
    "INSERT INTO dataset_archives (dataset_id, archive) SELECT dataset_id, ?2 FROM datasets WHERE hash = ?1 "
    "ON CONFLICT (dataset_id) DO NOTHING";

inline constexpr char kFindArchive[] =
    "SELECT archive FROM dataset_archives JOIN datasets USING (dataset_id) WHERE hash = ?1";

inline constexpr char kArchiveFacts[] =
    "SELECT EXISTS (SELECT 1 FROM experiments JOIN datasets USING (dataset_id) WHERE hash = ?1), "
    "EXISTS (SELECT 1 FROM dataset_archives JOIN datasets USING (dataset_id) WHERE hash = ?1), "
    "(SELECT coalesce(sum(length(archive)), 0) FROM dataset_archives)";

// Session and commit counter, see db/file_state.h.
inline constexpr char kCountCommit[] = "UPDATE file_state SET commits = commits + 1";

inline constexpr char kPutDataset[] =
    "INSERT INTO datasets (hash, name, joint_names) VALUES (?1, ?2, nullif(?3, '')) ON CONFLICT (hash) DO UPDATE "
    "SET joint_names = excluded.joint_names WHERE joint_names IS NULL AND excluded.joint_names IS NOT NULL";

inline constexpr char kFindDataset[] = "SELECT dataset_id FROM datasets WHERE hash = ?1";

inline constexpr char kPutMethod[] =
    "INSERT INTO methods (hash, name, options_json, multi_starts, sample_size, incremental, collision) "
    "VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7) ON CONFLICT (hash, name) DO NOTHING";

inline constexpr char kFindMethod[] = "SELECT method_id FROM methods WHERE hash = ?1 AND name = ?2";

inline constexpr char kFindProblems[] = "SELECT task, problem_id, problem_key FROM problems WHERE dataset_id = ?1";

inline constexpr char kInsertExperiment[] =
    "INSERT INTO experiments (experiment_id, submission_id, name, dataset_id, seed, repetitions, "
    "max_attempts, wall_limit_us, memory_limit_bytes, first_job_id, num_jobs, spec_json, "
    "spec_hash, submitted_at_us, submitter, builds, rule) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, "
    "?13, ?14, ?15, ?16, ?17)";

inline constexpr char kInsertCell[] =
    "INSERT INTO cells (cell_id, experiment_id, method_id, task, initialization, num_jobs, wall_limit_us, "
    "effort_limit) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, nullif(?8, 0))";

// Number of rows per INSERT of a submission. One statement per row would take twice as long.
inline constexpr std::size_t kRowsPerBatch = 64;

inline std::string Repeated(const std::string& row, std::size_t count) {
  std::string sql = row;
  for (std::size_t i = 1; i < count; ++i) sql += ", " + row;
  return sql;
}

inline std::string InsertProblems(std::size_t count) {
  return "INSERT INTO problems (dataset_id, task, problem_id, waypoints) VALUES " + Repeated("(?, ?, ?, ?)", count) +
         " ON CONFLICT (dataset_id, task, problem_id) DO NOTHING";
}

inline std::string InsertJobs(std::size_t count) {
  return "INSERT INTO jobs (job_id, cell_id, problem_key, repetition, max_attempts) VALUES " +
         Repeated("(?, ?, ?, ?, ?)", count);
}

// Returns for each cell: experiment and the numbers of jobs, open, leased and dead jobs, results, failed jobs, solved
// jobs and reused results.
inline constexpr char kCountByCell[] =
    "SELECT c.experiment_id, c.num_jobs, "
    "(SELECT count(*) FROM jobs AS j WHERE j.cell_id = c.cell_id AND j.state IN ('queued', 'leased')), "
    "(SELECT count(*) FROM jobs AS j WHERE j.cell_id = c.cell_id AND j.state IN ('queued', 'leased') "
    "AND +j.state = 'leased'), s.dead, s.done, s.failed, "
    "(SELECT solved FROM rule_scores AS u WHERE u.cell_id = c.cell_id), s.taken_over "
    "FROM cells AS c JOIN cell_states AS s USING (cell_id)";

inline constexpr char kFindAttempt[] =
    "SELECT a.token, a.worker_id, a.outcome, j.state FROM attempts AS a JOIN jobs AS j USING (job_id) "
    "WHERE a.job_id = ?1 AND a.attempt = ?2";

inline constexpr char kFindOptions[] = "SELECT options_json FROM methods WHERE hash = ?1 ORDER BY method_id LIMIT 1";

}  // namespace legopt::db::sql

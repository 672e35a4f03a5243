#include "tests/bench/filled_tables.h"

#include <string>
#include <utility>

#include "db/connection.h"

namespace legopt::db {
namespace {

constexpr char kShared[] = R"sql(
  INSERT INTO datasets (dataset_id, name, hash) VALUES (1, 'garage', printf('%064x', 1));
  WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 100)
    INSERT INTO workers (worker_id, endpoint, name, hostname, pid, slots, build, first_seen_at_us, last_seen_at_us,
      build_id) SELECT i, i + 1, 'w' || i, 'host', 1, 1, '', 0, 0, 'build' FROM n;
  WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 16)
    INSERT INTO methods SELECT i, 'method ' || i, printf('%064x', i), '{}', 0, 100, 0, 'solid' FROM n;
  WITH RECURSIVE n(i) AS (SELECT 0 UNION ALL SELECT i + 1 FROM n WHERE i < 2 * $problems - 1)
    INSERT INTO problems SELECT i + 1, 1, iif(i % 2, 'motion', 'posture'), i / 2, 1 FROM n;
)sql";

// Statements for one experiment; ?1 is its number, counted from 1. $problems: of a task; $jobs: of an experiment.
constexpr const char* kExperimentStatements[] = {
    "INSERT INTO experiments (experiment_id, submission_id, name, dataset_id, seed, repetitions, max_attempts, "
    "wall_limit_us, memory_limit_bytes, first_job_id, num_jobs, spec_json, spec_hash, submitted_at_us, build_id) "
    "VALUES (?1, 's' || ?1, 'e' || ?1, 1, 1, 1, 3, 1, 1, $jobs * (?1 - 1) + 1, $jobs, '{}', printf('%064x', 1), 0, "
    "'build')",
    "WITH RECURSIVE n(i) AS (SELECT 0 UNION ALL SELECT i + 1 FROM n WHERE i < 63) "
    "INSERT INTO cells (cell_id, experiment_id, method_id, task, initialization, num_jobs, wall_limit_us) "
    "SELECT 64 * (?1 - 1) + i + 1, ?1, 1 + i / 4, iif(i % 2, 'motion', 'posture'), "
    "iif(i / 2 % 2, 'in_collision', 'good'), $problems, 1 FROM n",
    "INSERT INTO jobs (job_id, cell_id, problem_key, repetition, state, attempts, returned, max_attempts) "
    "SELECT $problems * (cell_id - 1) + 1 + problem_id, cell_id, problem_key, 0, 'leased', 1, 0, 3 "
    "FROM cells JOIN problems USING (task) WHERE experiment_id = ?1",
    "INSERT INTO attempts (job_id, attempt, worker_id, token, leased_at_us) "
    "SELECT job_id, 1, 1 + job_id % 100, job_id, 0 FROM jobs WHERE job_id > $jobs * (?1 - 1)",
    "INSERT INTO results (job_id, cell_id, attempt, solver_status, iterations, restarts, wall_us, cpu_us, "
    "involuntary_context_switches, peak_memory_bytes, verdict_literal, verdict_strict, verdict_solid, "
    "verdict_physical, "
    "verdict_detail, cost, num_waypoints, received_at_us, trace, starts, term_evaluations, collision_queries) "
    "SELECT job_id, cell_id, 1, 'converged_feasible', 20, 0, 1000 + abs(random()) % 100000, 900, 0, 1 << 20, "
    "iif(job_id % 10, 'success', 'com'), iif(job_id % 10 AND job_id % 9, 'success', 'com'), "
    "iif(job_id % 10 AND job_id % 9 AND job_id % 8, 'success', 'com'), "
    "iif(job_id % 10 AND job_id % 9 AND job_id % 8 AND job_id % 7, 'success', 'torque'), '', 300 + abs(random()) % "
    "200000 / 1e3, 1, 0, "
    "randomblob(300), 1, 1000, 100 FROM jobs WHERE job_id > $jobs * (?1 - 1)",
    "UPDATE attempts SET outcome = 'finished', ended_at_us = 1 WHERE job_id > $jobs * (?1 - 1)",
    "UPDATE jobs SET state = 'done' WHERE job_id > $jobs * (?1 - 1)",
    "UPDATE experiments SET state = 'done', finished_at_us = 10 WHERE experiment_id = ?1"};

std::string Completed(std::string sql, int problems) {
  const std::pair<std::string, std::int64_t> values[] = {{"$problems", problems}, {"$jobs", JobsOf(problems)}};
  for (const auto& [name, value] : values) {
    for (std::size_t at = sql.find(name); at != std::string::npos; at = sql.find(name)) {
      sql.replace(at, name.size(), std::to_string(value));
    }
  }
  return sql;
}

}  // namespace

void FillTables(const std::filesystem::path& file, int experiments, int problems) {
  Connection connection(file, Connection::Mode::kReadWriteCreate);
  connection.Execute("PRAGMA synchronous = OFF; PRAGMA cache_size = -400000");
  connection.Execute(Completed(kShared, problems));
  for (std::int64_t experiment = 1; experiment <= experiments; ++experiment) {
    Transaction transaction(connection);
    for (const char* statement : kExperimentStatements) {
      Statement(connection, Completed(statement, problems), false).Run(experiment);
    }
    transaction.Commit();
  }
}

}  // namespace legopt::db

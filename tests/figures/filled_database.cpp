#include "tests/figures/filled_database.h"

#include "db/connection.h"

namespace legopt::figures {
namespace {

// Writes the rows that a server would: leased, finished with a posture of 36 numbers, done.
void FillResults(const std::filesystem::path& file, int results) {
  db::Connection connection(file, db::Connection::Mode::kReadWriteCreate);
  connection.Execute("PRAGMA synchronous = OFF");
  db::Transaction transaction(connection);
  const std::string some = " WHERE job_id <= " + std::to_string(results);
  connection.Execute(
      "INSERT INTO workers (worker_id, endpoint, name, hostname, pid, slots, build, first_seen_at_us, last_seen_at_us) "
      "VALUES (1, 2, 'w', 'host', 1, 1, '', 0, 0)");
  connection.Execute("UPDATE jobs SET state = 'leased', attempts = 1" + some);
  connection.Execute(
      "INSERT INTO attempts (job_id, attempt, worker_id, token, leased_at_us) SELECT job_id, 1, 1, job_id, 0 FROM "
      "jobs" +
      some);
  connection.Execute(
      "INSERT INTO results (job_id, cell_id, attempt, solver_status, iterations, restarts, wall_us, cpu_us, "
      "involuntary_context_switches, peak_memory_bytes, verdict_literal, verdict_strict, verdict_detail, cost, "
      "num_waypoints, received_at_us, trace) SELECT job_id, cell_id, 1, 'converged_feasible', 20, 0, 1000, 900, "
      "0, 1 << 20, 'success', 'success', '', 300, 1, 0, randomblob(300) FROM jobs" +
      some);
  connection.Execute("INSERT INTO waypoints SELECT job_id, 0, randomblob(288) FROM jobs" + some);
  connection.Execute("UPDATE attempts SET outcome = 'finished', ended_at_us = 1");
  connection.Execute("UPDATE jobs SET state = 'done'" + some);
  transaction.Commit();
}

}  // namespace

std::unique_ptr<service::Deployment> FilledDeployment(int results, int open) {
  constexpr int kWork_ms = 5;
  auto deployment = std::make_unique<service::Deployment>();
  deployment->StartServer();
  deployment->Submit(service::StubSpec(results + open, kWork_ms), "filled");
  deployment->server().Stop(std::chrono::seconds(10));
  FillResults(deployment->database(), results);
  return deployment;
}

}  // namespace legopt::figures

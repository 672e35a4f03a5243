// What the store costs: commits, group commit, and the benchmark table over a million results.

#include <benchmark/benchmark.h>

#include <filesystem>

#include "db/connection.h"
#include "db/read_only_database.h"
#include "db/sqlite_store.h"
#include "tests/db/store_samples.h"

namespace legopt::db {
namespace {

// One transaction per iteration, each with state.range(0) jobs leased and finished (36 numbers, as a posture has).
void BM_Commit(benchmark::State& state) {
  const TemporaryFolder folder;
  const auto store = OpenSqliteStore(folder / "bench.sqlite");
  constexpr int kNumProblems = 250'000;
  store->Apply(
      std::vector<StoreOp>{CreateExperiment{SampleExperiment(1, 1, 1, kNumProblems)}, PutWorker{SampleWorker(1)}});
  ResultRecord result = SampleResult();
  result.waypoint_size = 36;
  result.waypoints.assign(36, 0.25);
  std::int64_t job = 0;
  for (auto _ : state) {
    if (job + state.range(0) > 2 * kNumProblems) {
      state.SkipWithError("out of jobs");
      break;
    }
    std::vector<StoreOp> ops;
    for (std::int64_t i = 0; i < state.range(0); ++i) {
      ++job;
      ops.emplace_back(LeaseJob{job, 1, job, 1, 1});
      ops.emplace_back(AcceptResult{job, 1, result, "", "", 2});
    }
    store->Apply(ops);
  }
  state.counters["jobs/s"] = benchmark::Counter(static_cast<double>(job), benchmark::Counter::kIsRate);
}
BENCHMARK(BM_Commit)->Arg(1)->Arg(10)->Arg(100)->UseRealTime()->MinTime(1.0);

void BM_SubmitJobs(benchmark::State& state) {
  const TemporaryFolder folder;
  const auto store = OpenSqliteStore(folder / "bench.sqlite");
  const auto num_problems = static_cast<int>(state.range(0) / 2);
  std::int64_t id = 1;
  for (auto _ : state) {
    store->Apply(std::vector<StoreOp>{
        CreateExperiment{SampleExperiment(id, 1 + (id - 1) * 2 * num_problems, 1 + 2 * (id - 1), num_problems)}});
    ++id;
  }
}
BENCHMARK(BM_SubmitJobs)->Arg(10'000)->Unit(benchmark::kMillisecond)->UseRealTime();

constexpr int kMillion = 1'000'000;

// 16 methods x 2 tasks x 2 initialisations x 15,625 jobs, nine in ten solved.
const std::filesystem::path& MillionResults() {
  static const TemporaryFolder folder;
  static const std::filesystem::path path = [] {
    auto file = folder / "million.sqlite";
    { OpenSqliteStore(file); }
    Connection connection(file, Connection::Mode::kReadWriteCreate);
    connection.Execute("PRAGMA synchronous = OFF");
    Transaction transaction(connection);
    connection.Execute(R"sql(
      INSERT INTO datasets VALUES (1, 'garage', printf('%064x', 1));
      INSERT INTO workers (worker_id, endpoint, name, hostname, pid, slots, build, first_seen_at_us, last_seen_at_us)
        VALUES (1, 2, 'w', 'host', 1, 1, '', 0, 0);
      WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 16)
        INSERT INTO methods SELECT i, 'method ' || i, printf('%064x', i), '{}', 0, 100, 0, 'solid' FROM n;
      WITH RECURSIVE n(i) AS (SELECT 0 UNION ALL SELECT i + 1 FROM n WHERE i < 31249)
        INSERT INTO problems SELECT i + 1, 1, iif(i % 2, 'motion', 'posture'), i / 2, 1 FROM n;
      INSERT INTO experiments VALUES (1, 's', 'million', 'active', 1, 1, 1, 3, 1, 1, 1, 1000000, '{}',
        printf('%064x', 1), 0, NULL);
      WITH RECURSIVE n(i) AS (SELECT 0 UNION ALL SELECT i + 1 FROM n WHERE i < 63)
        INSERT INTO cells SELECT i + 1, 1, 1 + i / 4, iif(i % 2, 'motion', 'posture'),
          iif(i / 2 % 2, 'in_collision', 'good'), 15625, 1, NULL FROM n;
      INSERT INTO jobs SELECT 15625 * (cell_id - 1) + 1 + problem_id, cell_id, problem_key, 0, 'leased', 1, 0, 3
        FROM cells JOIN problems USING (task);
      INSERT INTO attempts (job_id, attempt, worker_id, token, leased_at_us) SELECT job_id, 1, 1, job_id, 0 FROM jobs;
      INSERT INTO results (job_id, cell_id, attempt, solver_status, iterations, restarts, wall_us, cpu_us,
          involuntary_context_switches, peak_memory_bytes, verdict_literal, verdict_strict, verdict_detail, cost,
          num_waypoints, received_at_us, trace)
        SELECT job_id, cell_id, 1, 'converged_feasible', 20, 0, 1000 + abs(random()) % 100000, 900, 0, 1 << 20,
          iif(job_id % 10, 'success', 'com'), iif(job_id % 9, 'success', 'com'), '', 300 + abs(random()) % 200000 / 1e3,
          1, 0, randomblob(300) FROM jobs;
      UPDATE attempts SET outcome = 'finished', ended_at_us = 1;
      UPDATE jobs SET state = 'done';
    )sql");
    transaction.Commit();
    return file;
  }();
  return path;
}

void BM_TableOverAMillionResults(benchmark::State& state) {
  ReadOnlyDatabase database(MillionResults());
  for (auto _ : state) {
    const QueryResult table = database.Query("SELECT * FROM benchmark_table WHERE experiment_id = 1");
    if (table.rows.size() != 16) state.SkipWithError("wrong table");
  }
}
BENCHMARK(BM_TableOverAMillionResults)->Unit(benchmark::kMillisecond)->UseRealTime();

void BM_CellsOfBothRulesOverAMillionResults(benchmark::State& state) {
  ReadOnlyDatabase database(MillionResults());
  for (auto _ : state)
    benchmark::DoNotOptimize(database.Query("SELECT * FROM benchmark_cells WHERE experiment_id = 1"));
}
BENCHMARK(BM_CellsOfBothRulesOverAMillionResults)->Unit(benchmark::kMillisecond)->UseRealTime();

void BM_LoadStateWithAMillionJobs(benchmark::State& state) {
  MillionResults();
  for (auto _ : state) {
    const auto store = OpenSqliteStore(MillionResults());
    if (store->LoadOpenState().open.size() != 1) state.SkipWithError("wrong state");
  }
  state.SetItemsProcessed(state.iterations() * kMillion);
}
BENCHMARK(BM_LoadStateWithAMillionJobs)->Unit(benchmark::kMillisecond)->UseRealTime()->Iterations(1);

}  // namespace
}  // namespace legopt::db

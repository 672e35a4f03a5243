// Cost of the store: commits, group commit, and the benchmark table over a million results.

#include <benchmark/benchmark.h>

#include <filesystem>

#include "db/read_only_database.h"
#include "db/sqlite_store.h"
#include "tests/bench/filled_tables.h"
#include "tests/db/store_samples.h"

namespace legopt::db {
namespace {

// One transaction per iteration leases and finishes state.range(0) jobs, each with 36 numbers as for a posture.
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

const std::filesystem::path& MillionResults() {
  static const TemporaryFolder folder;
  static const std::filesystem::path path = [] {
    auto file = folder / "million.sqlite";
    { OpenSqliteStore(file); }
    FillTables(file, 1);
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
  state.SetItemsProcessed(state.iterations() * JobsOf(kProblemsOfAMillion));
}
BENCHMARK(BM_LoadStateWithAMillionJobs)->Unit(benchmark::kMillisecond)->UseRealTime()->Iterations(1);

}  // namespace
}  // namespace legopt::db

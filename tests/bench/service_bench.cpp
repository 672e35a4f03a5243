// The service end to end with real processes over real LCM: what it costs to move a job, and what a second worker
// brings.
//
//   EmptyJobs          two workers of one slot, jobs that do nothing: jobs/s from the first lease to the last result
//   SolvingThroughput  the default dataset by SQP, once with one worker and once with two: jobs/s of both, and their
//   ratio

#include <benchmark/benchmark.h>

#include <memory>
#include <vector>

#include "tests/service/deployment.h"
#include "tests/service/posture_spec.h"

namespace legopt::service {
namespace {

constexpr double kMicroseconds = 1e6;

// Jobs per second of one experiment, start-up of processes excluded.
double RunExperiment(Deployment& deployment, const nlohmann::json& spec, const std::string& id) {
  const std::int64_t experiment = deployment.Submit(spec, id);
  deployment.WaitUntilDone(experiment);
  const std::vector<std::string> row = deployment.Query(
      "SELECT count(*), max(ended_at_us) - min(leased_at_us) FROM attempts JOIN job_list USING (job_id) WHERE "
      "experiment_id = " +
      std::to_string(experiment));
  const std::size_t bar = row.at(0).find('|');
  return std::stod(row[0].substr(0, bar)) * kMicroseconds / std::stod(row[0].substr(bar + 1));
}

std::unique_ptr<client::ChildProcess> Solver(const Deployment& deployment) {
  return deployment.StartWorker("legopt-worker", {"--slots", "1", "--dataset", DefaultDataset().string()});
}

void EmptyJobs(benchmark::State& state) {
  double rate = 0;
  for (auto _ : state) {
    Deployment deployment;
    deployment.StartServer();
    const auto first = deployment.StartStubWorker();
    const auto second = deployment.StartStubWorker();
    RunExperiment(deployment, StubSpec(200, 0), "warm-up");
    rate = RunExperiment(deployment, StubSpec(static_cast<int>(state.range(0)), 0), "measured");
  }
  state.counters["jobs/s"] = rate;
}

void SolvingThroughput(benchmark::State& state) {
  const auto repetitions = static_cast<int>(state.range(0));
  double one = 0;
  double two = 0;
  for (auto _ : state) {
    Deployment deployment;
    deployment.StartServer();
    const auto first = Solver(deployment);
    RunExperiment(deployment, PostureSpec(1), "warm-up");
    one = RunExperiment(deployment, PostureSpec(repetitions), "one worker");
    const auto second = Solver(deployment);
    RunExperiment(deployment, PostureSpec(3), "warm-up of the second");
    two = RunExperiment(deployment, PostureSpec(repetitions), "two workers");
  }
  state.counters["jobs/s of 1"] = one;
  state.counters["jobs/s of 2"] = two;
  state.counters["ratio"] = two / one;
}

BENCHMARK(EmptyJobs)->Arg(10'000)->Iterations(1)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK(SolvingThroughput)->Arg(40)->Iterations(1)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace legopt::service

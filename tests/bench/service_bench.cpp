// The service end to end with real processes over real LCM: overhead per job and speed-up by a second worker.
//
// EmptyJobs          two workers of one slot, jobs that do nothing: jobs/s from the first lease to the last result
// QuickJobs          two workers of two slots, jobs that sleep for N ms: share of the slots' time spent on jobs
// SolvingThroughput  the default dataset by SQP: jobs/s of one worker, of two, and their ratio
//
// "server us/job" is the server's CPU time, "server MB" its peak memory.

#include <benchmark/benchmark.h>
#include <unistd.h>

#include <fstream>
#include <memory>
#include <sstream>
#include <vector>

#include "tests/service/deployment.h"
#include "tests/service/posture_spec.h"

namespace legopt::service {
namespace {

constexpr double kMicroseconds = 1e6;

// Returns the jobs per second of one experiment, start-up of processes excluded.
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

// Returns the user and system CPU time of a process: fields 14 and 15 of /proc/PID/stat.
double CpuSeconds(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
  std::string text((std::istreambuf_iterator<char>(file)), {});
  std::istringstream fields(text.substr(text.rfind(')') + 2));
  std::string skipped;
  constexpr int kFieldsBefore = 11;
  for (int i = 0; i < kFieldsBefore; ++i) fields >> skipped;
  double user = 0;
  double system = 0;
  fields >> user >> system;
  return (user + system) / static_cast<double>(sysconf(_SC_CLK_TCK));
}

// Returns the peak memory of a process in megabytes: VmHWM of /proc/PID/status.
double PeakMegabytes(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/status");
  std::string word;
  double kilobytes = 0;
  while (file >> word && word != "VmHWM:") {
  }
  file >> kilobytes;
  constexpr double kKilobytes = 1000;
  return kilobytes / kKilobytes;
}

void EmptyJobs(benchmark::State& state) {
  double rate = 0;
  double cpu = 0;
  double peak = 0;
  for (auto _ : state) {
    Deployment deployment;
    deployment.StartServer();
    const auto first = deployment.StartStubWorker();
    const auto second = deployment.StartStubWorker();
    RunExperiment(deployment, StubSpec(200, 0), "warm-up");
    const double before = CpuSeconds(deployment.server().pid());
    rate = RunExperiment(deployment, StubSpec(static_cast<int>(state.range(0)), 0), "measured");
    cpu = CpuSeconds(deployment.server().pid()) - before;
    peak = PeakMegabytes(deployment.server().pid());
  }
  state.counters["jobs/s"] = rate;
  state.counters["server us/job"] = kMicroseconds * cpu / static_cast<double>(state.range(0));
  state.counters["server MB"] = peak;
}

// Returns the seconds during which an experiment's jobs occupied slots.
double BusySeconds(const Deployment& deployment, const std::string& name) {
  const std::string sql =
      "SELECT sum(r.wall_us) FROM results AS r JOIN cells USING (cell_id) JOIN experiments AS e "
      "USING (experiment_id) WHERE e.name = '";
  return std::stod(deployment.Query(sql + name + "'").at(0)) / kMicroseconds;
}

nlohmann::json TimedStubSpec(const std::string& name, int jobs, int work_ms) {
  nlohmann::json spec = StubSpec(jobs, work_ms);
  spec["name"] = name;
  spec["methods"][0]["options"]["timed"] = true;
  return spec;
}

void QuickJobs(benchmark::State& state) {
  constexpr int kWorkers = 2;
  constexpr int kSlots = 2;
  constexpr double kJobs = 4000;
  const auto work_ms = static_cast<int>(state.range(0));
  double rate = 0;
  double cpu = 0;
  double busy = 0;
  for (auto _ : state) {
    Deployment deployment;
    deployment.StartServer();
    const auto first = deployment.StartStubWorker({"--slots", std::to_string(kSlots)});
    const auto second = deployment.StartStubWorker({"--slots", std::to_string(kSlots)});
    RunExperiment(deployment, TimedStubSpec("warm-up", 200, work_ms), "warm-up");
    const double before = CpuSeconds(deployment.server().pid());
    rate = RunExperiment(deployment, TimedStubSpec("measured", static_cast<int>(kJobs), work_ms), "measured");
    busy = BusySeconds(deployment, "measured");
    cpu = CpuSeconds(deployment.server().pid()) - before;
  }
  constexpr double kPercent = 100;
  state.counters["jobs/s"] = rate;
  state.counters["busy %"] = kPercent * busy * rate / (kJobs * kWorkers * kSlots);
  state.counters["server us/job"] = kMicroseconds * cpu / kJobs;
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
BENCHMARK(QuickJobs)->Arg(2)->Arg(5)->Arg(10)->Iterations(1)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK(SolvingThroughput)->Arg(40)->Iterations(1)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace legopt::service

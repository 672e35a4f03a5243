#include <algorithm>
#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "client/service/child_process.h"
#include "tests/figures/figures.h"
#include "tests/figures/lease_prober.h"
#include "tests/figures/process_facts.h"
#include "tests/service/deployment.h"

namespace legopt::figures {
namespace {

using service::Deployment;
using std::chrono::milliseconds;
using std::chrono::seconds;
using Workers = std::vector<std::unique_ptr<client::ChildProcess>>;

constexpr int kJobs = 10'000;
constexpr int kWorkers = 2;
constexpr double kMinRate_per_s = 200;
constexpr double kMaxLease_ms = 50;
constexpr double kMaxServer_mb = 200;
constexpr double kMaxCost_percent = 2;

// Returns the CPU time of the supervisors so far, without that of the jobs, which run in child processes.
double SupervisorsCpu_s(const Workers& workers) {
  double cpu_s = 0;
  for (const auto& worker : workers) cpu_s += FactsOf(worker->pid()).cpu_s;
  return cpu_s;
}

// Runs jobs of `work_ms` each, submitted at once, while one more worker measures the latency of leases. Returns
// seconds.
double RunJobs(Deployment& deployment, int jobs, int work_ms, Findings& findings) {
  LeaseProber prober(deployment.port());
  std::atomic<bool> stop{false};
  double took_s = 0;
  std::int64_t experiment = 0;
  std::jthread watcher([&] {
    const auto begin = Clock::now();
    experiment = deployment.Submit(service::StubSpec(jobs, work_ms), "jobs of " + std::to_string(work_ms) + " ms");
    constexpr seconds kPatience{600};
    deployment.WaitFor(
        experiment, [](const nlohmann::json& status) { return status.at("state") != "active"; }, kPatience);
    took_s = SecondsSince(begin);
    stop = true;
  });
  prober.Run(stop);
  watcher.join();
  const auto rows = deployment.Query(
      "SELECT count(*), count(DISTINCT r.job_id) FROM results AS r JOIN cells USING (cell_id) WHERE experiment_id = " +
      std::to_string(experiment));
  const std::string all = std::to_string(jobs) + "|" + std::to_string(jobs);
  findings.Promise(rows.at(0) == all, "jobs of " + std::to_string(work_ms) + " ms with a result, different jobs: " +
                                          rows.at(0) + ", in " + std::to_string(took_s) + " s");
  const auto& latencies = prober.latencies_ms();
  findings.Promise(prober.timeouts() == 0 && !latencies.empty(),
                   std::to_string(latencies.size()) + " lease calls, none unanswered");
  findings.Note("lease median " + std::to_string(Quantile(latencies, 0.5)) + " ms, longest " +
                std::to_string(Quantile(latencies, 1)) + " ms");
  findings.Quantity("lease p99", Quantile(latencies, 0.99), kMaxLease_ms, "ms");
  return took_s;
}

// Measures the maximum rate of empty jobs.
void MeasureEmptyJobs(Deployment& deployment, const Workers& workers, int jobs, Findings& findings) {
  const double cpu_before_s = SupervisorsCpu_s(workers);
  const double took_s = RunJobs(deployment, jobs, 0, findings);
  findings.Note("CPU time of the supervisors " +
                std::to_string(1e6 * (SupervisorsCpu_s(workers) - cpu_before_s) / jobs) + " us per job");
  findings.Quantity("time per job, of the 5 ms of 200 jobs/s,", 1e3 * took_s / jobs, 1e3 / kMinRate_per_s, "ms");
  const double server_mb = FactsOf(deployment.server().pid()).resident_mb;
  findings.Promise(server_mb < kMaxServer_mb, "server below 200 MB: " + std::to_string(server_mb) + " MB");
}

// Measures the cost of heartbeats, progress and cancellation while every slot is busy with one long job.
void MeasureHeartbeats(Deployment& deployment, const Workers& workers, double watched_s, Findings& findings) {
  constexpr int kLong_ms = 600'000;
  const std::int64_t experiment = deployment.Submit(service::StubSpec(kWorkers, kLong_ms), "long jobs");
  const auto busy = [](const nlohmann::json& status) { return status.at("jobs").at("leased") == kWorkers; };
  findings.Promise(deployment.WaitFor(experiment, busy), "both slots are busy");
  std::this_thread::sleep_for(seconds(1));
  const double before_s = SupervisorsCpu_s(workers);
  const auto begin = Clock::now();
  std::this_thread::sleep_for(milliseconds(static_cast<int>(1e3 * watched_s)));
  const double share = (SupervisorsCpu_s(workers) - before_s) / SecondsSince(begin) / kWorkers;
  findings.Quantity("messaging of a worker whose job runs, share of a core", 100 * share, kMaxCost_percent, "%");
  deployment.connection().Cancel(experiment);
}

}  // namespace

void MeasureThroughput(const Request& request, Findings& findings) {
  const int jobs = request.count > 0 ? request.count : kJobs;
  constexpr double kWatched_s = 60;
  Deployment deployment;
  deployment.StartServer();
  Workers workers;
  for (int i = 0; i < kWorkers; ++i) workers.push_back(deployment.StartStubWorker());
  findings.Begin("24");
  MeasureEmptyJobs(deployment, workers, jobs, findings);
  constexpr int kWork_ms = 10;  // keeps two slots at 200 jobs/s
  RunJobs(deployment, jobs / 2, kWork_ms, findings);
  MeasureHeartbeats(deployment, workers, request.minutes > 0 ? 60 * request.minutes : kWatched_s, findings);
}

}  // namespace legopt::figures

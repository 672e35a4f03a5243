#include <algorithm>
#include <csignal>
#include <memory>
#include <string>

#include "tests/figures/figures.h"
#include "tests/figures/process_facts.h"
#include "tests/service/deployment.h"
#include "tests/service/posture_spec.h"

namespace legopt::figures {
namespace {

using service::Deployment;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr int kTrials = 20;
constexpr milliseconds kPatience = seconds(60);
constexpr double kMicro = 1e-6;
// The worker logs these when a process without a job dies.
constexpr const char* kIdleDeaths[] = {"between two jobs", "while it loaded its datasets"};

std::int64_t Number(const Deployment& deployment, const std::string& sql) {
  const auto rows = deployment.Query(sql);
  return rows.empty() || rows[0] == "NULL" ? 0 : std::stoll(rows[0]);
}

// Returns the time from the server's crash number `crash` to the third result after it: one result may have been in
// flight, and one more.
double SlotReturn(const Deployment& deployment, int crash) {
  const std::string crashed_at =
      "(SELECT ended_at_us FROM attempts WHERE outcome = 'crashed' ORDER BY ended_at_us LIMIT 1 OFFSET " +
      std::to_string(crash) + ")";
  const std::string third = "SELECT ended_at_us - " + crashed_at +
                            " FROM attempts WHERE outcome = 'finished' AND ended_at_us > " + crashed_at +
                            " ORDER BY ended_at_us LIMIT 1 OFFSET 2";
  std::int64_t took_us = 0;
  WaitUntil([&] { return (took_us = Number(deployment, third)) > 0; }, kPatience);
  return static_cast<double>(took_us) * kMicro;
}

int IdleDeaths(const client::ChildProcess& worker) {
  const std::string text = worker.ErrorTail();
  int times = 0;
  for (const std::string words : kIdleDeaths) {
    for (auto at = text.find(words); at != std::string::npos; at = text.find(words, at + 1)) ++times;
  }
  return times;
}

// Kills the worker's job process until one dies while solving, which the server records as crash number `crash`; the
// death of an idle process costs no attempt. Waits for a result before each kill: a process that is killed while it
// starts is started again later and later. Returns false if no crash is recorded.
bool KillAtWork(const Deployment& deployment, const client::ChildProcess& worker, int crash) {
  const std::string crashes = "SELECT count(*) FROM attempts WHERE outcome = 'crashed'";
  const std::string results = "SELECT count(*) FROM attempts WHERE outcome = 'finished'";
  constexpr int kTries = 20;
  for (int i = 0; i < kTries; ++i) {
    const int idle_deaths = IdleDeaths(worker);
    const std::int64_t results_before = Number(deployment, results);
    // One of the results may have been on its way from the process that died before.
    const auto works = [&] { return Number(deployment, results) > results_before + 1; };
    if (!WaitUntil(works, kPatience) || ChildrenOf(worker.pid()).empty()) return false;
    kill(ChildrenOf(worker.pid()).at(0), SIGSEGV);
    const auto ended = [&] { return Number(deployment, crashes) > crash || IdleDeaths(worker) > idle_deaths; };
    if (!WaitUntil(ended, kPatience)) return false;
    if (Number(deployment, crashes) > crash) return true;
  }
  return false;
}

nlohmann::json EndlessJobs(int jobs) {
  constexpr int kHour_ms = 3'600'000;
  nlohmann::json spec = service::StubSpec(jobs, kHour_ms);
  spec["limits"]["wall_time_s"] = 1;
  spec["max_attempts"] = 1;
  return spec;
}

void MeasureWallLimit(int jobs, Findings& findings) {
  Deployment deployment;
  deployment.StartServer();
  const auto worker = deployment.StartStubWorker({"--slots", "2"});
  const std::int64_t experiment = deployment.Submit(EndlessJobs(jobs), "endless");
  deployment.WaitFor(
      experiment, [](const nlohmann::json& status) { return status.at("state") != "active"; }, seconds(60 + 5 * jobs));
  const std::string ended = "SELECT count(*) FROM attempts WHERE outcome = 'time_limit'";
  findings.Promise(Number(deployment, ended) == jobs, std::to_string(jobs) + " endless jobs ended at their limit");
  const double slowest_s =
      static_cast<double>(Number(deployment, "SELECT max(ended_at_us - leased_at_us) FROM attempts")) * kMicro;
  // Killed at limit + 1 s; the transit times of the lease and of the report are added.
  findings.Quantity("an endless job of limit 1 s is killed and reported, from its lease,", slowest_s, 2.5, "s");
}

void MeasureOrphans(int trials, Findings& findings) {
  constexpr int kSlots = 2;
  Deployment deployment;
  deployment.StartServer();
  nlohmann::json spec = service::StubSpec(kSlots, 3'600'000);
  spec["max_attempts"] = 100;
  const std::int64_t experiment = deployment.Submit(spec, "long");
  double slowest_s = 0;
  int gone = 0;
  for (int trial = 0; trial < trials; ++trial) {
    const auto worker = deployment.StartStubWorker({"--slots", std::to_string(kSlots)});
    if (!WaitUntil([&] { return ChildrenOf(worker->pid()).size() == kSlots; }, kPatience)) break;
    std::vector<std::unique_ptr<EndOf>> ends;
    for (const pid_t child : ChildrenOf(worker->pid())) ends.push_back(std::make_unique<EndOf>(child));
    const auto killed = Clock::now();
    worker->Signal(SIGKILL);
    const auto all_gone = [&] {
      return std::all_of(ends.begin(), ends.end(), [](const auto& end) { return end->reached(); });
    };
    gone += WaitUntil(all_gone, kPatience) ? 1 : 0;
    slowest_s = std::max(slowest_s, SecondsSince(killed));
  }
  deployment.connection().Cancel(experiment);
  findings.Promise(gone == trials, "job processes gone after SIGKILL of their supervisor in " + std::to_string(gone) +
                                       " of " + std::to_string(trials) + " trials");
  findings.Quantity("slowest of them", slowest_s, 1, "s");
}

}  // namespace

void MeasureSlotReturn(const Request& request, Findings& findings) {
  findings.Begin("8");
  const int trials = request.count > 0 ? request.count : kTrials;
  constexpr int kPlenty = 1000;  // repetitions, so that the queue does not run empty
  Deployment deployment;
  deployment.StartServer();
  const auto worker =
      deployment.StartWorker("legopt-worker", {"--slots", "1", "--dataset", service::DefaultDataset().string()});
  const std::int64_t experiment = deployment.Submit(service::PostureSpec(kPlenty), "slots");
  deployment.WaitForJobs(experiment, 10);
  std::vector<double> took_s;
  for (int trial = 0; trial < trials; ++trial) {
    if (!KillAtWork(deployment, *worker, trial)) break;
    took_s.push_back(SlotReturn(deployment, trial));
  }
  deployment.connection().Cancel(experiment);
  findings.Promise(static_cast<int>(took_s.size()) == trials,
                   std::to_string(took_s.size()) + " deaths of a job process, each seen as a crash of one attempt");
  const std::string signals =
      "SELECT count(*) FROM attempts WHERE outcome = 'crashed' AND exit_signal <> " + std::to_string(SIGSEGV);
  findings.Promise(Number(deployment, signals) == 0, "each with its signal");
  if (took_s.empty()) return;
  findings.Quantity("slot solves again after, slowest,", Quantile(took_s, 1), 2, "s");
  findings.Quantity("median", Quantile(took_s, 0.5), 2, "s");
}

void MeasureLimits(const Request& request, Findings& findings) {
  findings.Begin("9");
  const int trials = request.count > 0 ? request.count : kTrials;
  MeasureWallLimit(trials, findings);
  MeasureOrphans(trials, findings);
}

}  // namespace legopt::figures

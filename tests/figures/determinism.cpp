#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <csignal>
#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "client/suite/experiment_spec.h"
#include "legopt/dataset/dataset.h"
#include "legopt/solvers/methods/method.h"
#include "tests/figures/figures.h"
#include "tests/figures/process_facts.h"
#include "tests/service/deployment.h"
#include "worker/solve_executor.h"

namespace legopt::figures {
namespace {

using service::Deployment;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr int kPostures = 50;
constexpr int kMotions = 2;      // the shortest ones
constexpr int kSampleSize = 60;  // percent, of the sampled variants
constexpr int kEffort = 20'000;  // term evaluations of a motion; ends many, and ends must be reproducible
constexpr int kReplayed = 100;
constexpr seconds kSolvePatience{4 * 3600};
constexpr int kNoLimit_s = 3600;  // limit of a repeated job, more than it needs

// Returns the `most` problems of a task with the fewest waypoints.
std::vector<int> ShortestProblems(const client::DatasetFacts& facts, Task task, int most) {
  auto problems = facts.problems[task];
  std::stable_sort(problems.begin(), problems.end(),
                   [](const auto& a, const auto& b) { return a.waypoints < b.waypoints; });
  std::vector<int> ids;
  for (const auto& problem : problems) {
    if (static_cast<int>(ids.size()) < most) ids.push_back(problem.id);
  }
  std::sort(ids.begin(), ids.end());
  return ids;
}

// Returns every solver of the registry, plain, sampled and incremental, with a restart so that random numbers are
// used.
nlohmann::json EverySolver(const Dataset& dataset, int postures) {
  client::Suite suite;
  suite.name = "determinism";
  suite.seed = 23;
  suite.effort_limit[Task::kMotion] = kEffort;
  suite.max_attempts = 100;  // jobs are not charged for kills
  const client::DatasetFacts facts = client::FactsOf(dataset);
  suite.tasks = {{Task::kPosture, ShortestProblems(facts, Task::kPosture, postures)},
                 {Task::kMotion, ShortestProblems(facts, Task::kMotion, std::min(postures, kMotions))}};
  const auto add = [&suite](const nlohmann::json& method) {
    suite.methods.push_back(Method::FromJson(method, "determinism"));
  };
  for (const SolverEntry& entry : SolverRegistry()) {
    nlohmann::json method = {{"solver", entry.word}, {"multi_starts", 1}};
    add(method);
    if (!entry.samples) continue;
    method["sample_size"] = kSampleSize;
    add(method);
    method["incremental"] = true;
    add(method);
  }
  nlohmann::json spec = client::BuildSpec(suite, facts);
  spec["again"] = true;  // a second experiment must be solved, not reused
  return spec;
}

// All deterministic outcomes of a solve, without times and worker. Jobs of equal specifications are in the same order.
constexpr char kSolution[] =
    "SELECT method, sample_size, incremental, task, problem_id, initialization, repetition, r.solver_status, "
    "r.iterations, r.restarts, r.starts, r.term_evaluations, r.collision_queries, r.verdict_literal, r.verdict_strict, "
    "r.cost, waypoint, hex(x) FROM job_list JOIN results AS r USING (job_id) "
    "LEFT JOIN waypoints USING (job_id) WHERE experiment_id = ";

std::vector<std::string> Solutions(const Deployment& deployment, std::int64_t experiment) {
  return deployment.Query(kSolution + std::to_string(experiment) + " ORDER BY job_id, waypoint");
}

int CountOf(const Deployment& deployment, std::int64_t experiment, const std::string& condition) {
  return std::stoi(deployment
                       .Query("SELECT count(*) FROM job_list WHERE experiment_id = " + std::to_string(experiment) +
                              " AND " + condition)
                       .at(0));
}

bool WaitUntilDone(Deployment& deployment, std::int64_t experiment) {
  return deployment.WaitFor(
      experiment, [](const nlohmann::json& status) { return status.at("state") != "active"; }, kSolvePatience);
}

// Keeps all cores busy unless other processes already do.
class Load {
 public:
  Load() {
    const unsigned cores = std::max(1U, std::thread::hardware_concurrency());
    double load = 0;
    getloadavg(&load, 1);
    for (unsigned i = 0; load < cores && i < cores; ++i) {
      threads_.emplace_back([this] {
        while (!stop_) std::atomic_signal_fence(std::memory_order_seq_cst);
      });
    }
  }
  ~Load() {
    stop_ = true;
    for (std::thread& thread : threads_) thread.join();
  }
  Load(const Load&) = delete;
  Load& operator=(const Load&) = delete;

 private:
  std::atomic<bool> stop_{false};
  std::vector<std::thread> threads_;
};

class Runs {
 public:
  Runs(const std::filesystem::path& dataset, nlohmann::json spec) : dataset_(dataset), spec_(std::move(spec)) {
    deployment_.StartServer();
  }

  std::int64_t Calm() {
    const auto worker = Worker();
    return Done(deployment_.Submit(spec_, "calm"));
  }
  std::int64_t Loaded() {
    const Load load;
    const auto first = Worker();
    const auto second = Worker();
    return Done(deployment_.Submit(spec_, "loaded"));
  }
  // Kills job processes at random, so that second and third attempts determine results, and less and less often, so
  // that long jobs end. Starts after both workers have finished a job: a worker whose processes never start gives up
  // by design.
  std::int64_t Killed(std::uint64_t seed) {
    milliseconds pause(1000);
    std::mt19937_64 random(seed);
    const std::array workers = {Worker(), Worker()};
    const std::int64_t experiment = deployment_.Submit(spec_, "killed");
    const std::string at_work =
        "SELECT count(DISTINCT worker_id) FROM attempts JOIN job_list USING (job_id) WHERE outcome = 'finished' AND "
        "experiment_id = " +
        std::to_string(experiment);
    deployment_.WaitFor(
        experiment,
        [&](const nlohmann::json& status) {
          return status.at("state") != "active" || deployment_.Query(at_work).at(0) == std::to_string(workers.size());
        },
        kSolvePatience);
    auto next = Clock::now();
    deployment_.WaitFor(
        experiment,
        [&](const nlohmann::json& status) {
          if (Clock::now() >= next) {
            for (const pid_t child : ChildrenOf(workers[random() % workers.size()]->pid())) kill(child, SIGKILL);
            pause += pause / 10;
            next = Clock::now() + pause;
          }
          return status.at("state") != "active";
        },
        kSolvePatience);
    return experiment;
  }
  Deployment& deployment() { return deployment_; }

 private:
  std::unique_ptr<client::ChildProcess> Worker() {
    return deployment_.StartWorker("legopt-worker", {"--slots", "1", "--dataset", dataset_.string()});
  }
  std::int64_t Done(std::int64_t experiment) {
    WaitUntilDone(deployment_, experiment);
    return experiment;
  }

  std::filesystem::path dataset_;
  nlohmann::json spec_;
  Deployment deployment_;
};

std::string Hexadecimal(const std::vector<double>& numbers) {
  constexpr char kDigits[] = "0123456789ABCDEF";
  std::string hex;
  for (const double number : numbers) {
    const auto bits = std::bit_cast<std::uint64_t>(number);
    for (unsigned shift = 0; shift < 64; shift += 8) {  // little-endian
      const auto byte = static_cast<unsigned>(bits >> shift) & 255U;
      hex += {kDigits[byte >> 4U], kDigits[byte & 15U]};
    }
  }
  return hex;
}

// Solves stored rows again in this process. Returns how many of `rows` were reproduced.
int Replay(Deployment& deployment, const std::filesystem::path& dataset, const nlohmann::json& spec, int rows,
           std::uint64_t seed, int* replayed) {
  worker::SolveExecutor executor(worker::WorkerInputs{.datasets = {dataset}, .solvers = {}});
  const std::string hash = executor.Load().at(0).hash;
  const auto stored = deployment.Query(
      "SELECT m.hash, m.options_json, p.problem_id, c.initialization, j.repetition, r.solver_status, r.iterations, "
      "(SELECT group_concat(hex(x), '') FROM (SELECT x FROM waypoints AS w WHERE w.job_id = r.job_id ORDER BY "
      "waypoint)), c.task, c.effort_limit FROM results AS r JOIN jobs AS j USING (job_id) JOIN cells AS c ON c.cell_id "
      "= j.cell_id JOIN methods AS m USING (method_id) JOIN problems AS p USING (problem_key) ORDER BY r.job_id");
  std::mt19937_64 random(seed);
  int same = 0;
  *replayed = std::min<int>(rows, static_cast<int>(stored.size()));
  for (int i = 0; i < *replayed; ++i) {
    std::vector<std::string> cells;
    std::istringstream line(stored[random() % stored.size()]);
    for (std::string cell; std::getline(line, cell, '|');) cells.push_back(cell);
    legopt_msg::lease job{};
    job.dataset_hash = hash;
    job.method_hash = cells.at(0);
    job.task = cells.at(8);
    job.effort_limit = std::stoll(cells.at(9));
    job.problem_id = std::stoi(cells.at(2));
    job.initialization = cells.at(3);
    job.repetition = std::stoi(cells.at(4));
    job.experiment_seed = spec.at("seed").get<std::int64_t>();
    job.wall_limit_us = std::int64_t{kNoLimit_s} * 1'000'000;
    worker::JobExecutor::Hooks hooks{[] { return false; }, [](int, int) {}, [] {}};
    const legopt_msg::result_request again = executor.Execute(job, cells.at(1), hooks);
    const std::string bits = again.waypoints.empty() ? "NULL" : Hexadecimal(again.waypoints);
    const bool equal =
        again.solver_status == cells.at(5) && std::to_string(again.iterations) == cells.at(6) && bits == cells.at(7);
    same += equal ? 1 : 0;
  }
  return same;
}

}  // namespace

void MeasureDeterminism(const Request& request, Findings& findings) {
  findings.Begin("23");
  const nlohmann::json spec =
      EverySolver(*Dataset::Load(request.dataset), request.count > 0 ? request.count : kPostures);
  Runs runs(request.dataset, spec);
  const auto begin = Clock::now();
  const std::int64_t first = runs.Calm();
  const std::vector<std::string> calm = Solutions(runs.deployment(), first);
  const int jobs = CountOf(runs.deployment(), first, "state = 'done'");
  const int limited = CountOf(runs.deployment(), first, "solver_status = 'effort_limit'");
  findings.Note(std::to_string(jobs) + " jobs (methods x problems x starts), " + std::to_string(limited) +
                " of them ended by their effort limit, after " + std::to_string(SecondsSince(begin)) + " s");
  findings.Promise(jobs == client::CountJobs(spec), "every job has a result");
  findings.Promise(limited > 0 && limited < jobs, "the effort limit ends some jobs and not all");
  findings.Promise(Solutions(runs.deployment(), runs.Loaded()) == calm,
                   "the same status, effort and bits by two workers on a loaded machine");
  const std::int64_t killed = runs.Killed(request.seed);
  const std::string retried = runs.deployment().Query("SELECT count(*) FROM job_list WHERE attempts > 1").at(0);
  findings.Promise(Solutions(runs.deployment(), killed) == calm,
                   "the same with job processes killed; " + retried + " jobs needed more than one attempt");
  int replayed = 0;
  const int same = Replay(runs.deployment(), request.dataset, spec, kReplayed, request.seed, &replayed);
  findings.Promise(same == replayed, std::to_string(same) + " of " + std::to_string(replayed) +
                                         " random rows solved once more by another program are the same bits");
}

}  // namespace legopt::figures

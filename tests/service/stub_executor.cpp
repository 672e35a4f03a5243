#include "tests/service/stub_executor.h"

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <nlohmann/json.hpp>
#include <random>

#include "worker/job_executor.h"

namespace legopt::worker {
namespace {

constexpr int kNumbers = 36;

}  // namespace

std::vector<Capability> StubExecutor::Load() {
  constexpr std::size_t kDigits = 64;
  std::vector<Capability> loaded;
  for (const std::filesystem::path& folder : folders_) {
    const std::string text = folder.filename().string();
    loaded.push_back({text.substr(0, text.find('-')), std::string(kDigits, text.back())});
  }
  return loaded;
}

std::vector<double> StubExecutor::Solution(std::int64_t seed, int problem_id, int repetition, int waypoints) {
  std::seed_seq seeds{seed, std::int64_t{problem_id}, std::int64_t{repetition}};
  std::mt19937_64 random(seeds);
  std::vector<double> x(kNumbers * static_cast<std::size_t>(waypoints));
  for (double& value : x) value = static_cast<double>(random() >> 11) * 0x1p-53;
  return x;
}

legopt_msg::result_request StubExecutor::Execute(const legopt_msg::lease& job, std::string_view options_json,
                                                 const Hooks& hooks) {
  const nlohmann::json options = nlohmann::json::parse(options_json);
  if (options.value("crash_problem", -1) == job.problem_id) std::abort();
  const int spread_ms = options.value("work_spread_ms", 0);
  constexpr int kStep_ms = 37;
  const int work_ms = options.value("work_ms", 0) + (kStep_ms * job.problem_id) % (spread_ms + 1);
  legopt_msg::result_request result = ResultWithoutSolution(ReportedOutcome::kFinished, "");
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < work_ms; ++i) {
    if (hooks.cancelled()) {
      result.outcome = static_cast<std::int8_t>(ReportedOutcome::kCancelled);
      return result;
    }
    const timespec millisecond{0, 1'000'000};
    nanosleep(&millisecond, nullptr);
    hooks.progress(i + 1, work_ms);
  }
  if (options.value("slow_problem", -1) == job.problem_id && job.attempt <= options.value("slow_attempts", 0)) {
    return ResultWithoutSolution(ReportedOutcome::kTimeLimit, "stopped by the clock");
  }
  const bool stopped = options.value("stop_problem", -1) == job.problem_id && job.attempt == 1;
  result.solver_status = stopped ? "time_limit" : "converged_feasible";
  result.verdict_literal = result.verdict_strict = result.verdict_solid = result.verdict_physical =
      stopped ? "com" : "success";
  const auto wall = std::chrono::steady_clock::now() - start;
  constexpr std::int64_t kSame_us = 1000;  // so that identical jobs have identical results
  result.wall_us = options.value("timed", false) ? wall / std::chrono::microseconds(1) : kSame_us;
  result.cost = 1;
  result.num_waypoints = options.value("waypoints", 1);
  result.waypoint_size = kNumbers;
  result.waypoints = Solution(job.experiment_seed, job.problem_id, job.repetition, result.num_waypoints);
  result.windows = options.value("windows", 0);
  result.windows_solved = options.value("windows_solved", result.windows);
  if (result.windows_solved < result.windows) {
    result.solver_status = "converged_infeasible";
    result.verdict_literal = result.verdict_strict = result.verdict_solid = result.verdict_physical =
        "wrong_waypoint_count";
    result.verdict_detail = "stopped early";
    result.cost = std::nan("");
  }
  return result;
}

}  // namespace legopt::worker

#include "worker/solve_executor.h"

#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <utility>

#include "app/folder_cache.h"
#include "legopt/input/json.h"
#include "legopt/planning/internal/trace.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"
#include "legopt/types/task.h"
#include "worker/job_executor.h"

namespace legopt::worker {
namespace {

constexpr double kMicrosecondsPerSecond = 1e6;
constexpr std::size_t kMaxCachedMethods = 256;
constexpr char kLeaseSource[] = "job from the server";

// Returns the largest resident size of this process, which runs jobs one after another.
std::int64_t PeakMemoryBytes() {
  constexpr std::int64_t kKibibyte = 1024;
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::int64_t>(usage.ru_maxrss) * kKibibyte;
}

// An external solver runs in its own process, and its points are evaluated in this one: both count as CPU time of the
// solve. Memory is that of the solver only, because this process also holds the dataset and data of earlier jobs.
void ChargeExternal(const external::ProcessUsage& usage, legopt_msg::result_request& result) {
  if (usage.peak_memory_bytes == 0) return;
  result.cpu_us += usage.cpu_us;
  result.peak_memory_bytes = usage.peak_memory_bytes;
}

// A solve stopped at the wall-time limit is no result. A solve that used the time budget of its method is one.
ReportedOutcome OutcomeOf(const SolveOutcome& solve) {
  if (solve.status == SolveStatus::kCancelled) return ReportedOutcome::kCancelled;
  const bool stopped = solve.status == SolveStatus::kTimeLimit && !solve.budget_spent;
  return stopped ? ReportedOutcome::kTimeLimit : ReportedOutcome::kFinished;
}

std::string StoppedByTheClock(const SolveOutcome& solve) {
  const auto seconds = [](std::int64_t time_us) {
    return FormatGeneral(static_cast<double>(time_us) / kMicrosecondsPerSecond, 3) + " s";
  };
  return "stopped by the clock: the limit of wall time came before that of effort, after " + seconds(solve.wall_us) +
         " (" + seconds(solve.cpu_us) + " of CPU time) and " + std::to_string(solve.term_evaluations) +
         " term evaluations";
}

// Returns whether all waypoints have the same size. A failed solver may return anything; malformed waypoints are not
// sent, and the judge has already reported them.
bool OneShape(const std::vector<Eigen::VectorXd>& waypoints) {
  for (const Eigen::VectorXd& waypoint : waypoints) {
    if (waypoint.size() != waypoints.front().size()) return false;
  }
  return !waypoints.empty();
}

// Adds the best point of an unsolved window.
void AddUnsolved(const JobResult& job, legopt_msg::result_request& result) {
  if (job.evaluation.window) result.window_verdict = ToString(*job.evaluation.window);
  const std::vector<Eigen::VectorXd>& waypoints = job.solve.unsolved->waypoints;
  const bool finite = std::ranges::all_of(waypoints, [](const Eigen::VectorXd& x) { return x.allFinite(); });
  if (!OneShape(waypoints) || !finite) return;
  result.first_unsolved = NumWaypoints(job.task, job.solve.unsolved->first_stance);
  result.num_unsolved = static_cast<std::int32_t>(waypoints.size());
  for (const Eigen::VectorXd& x : waypoints) result.unsolved.insert(result.unsolved.end(), x.begin(), x.end());
}

void AddViolations(const Evaluation& evaluation, legopt_msg::result_request& result) {
  for (const Violation& violation : evaluation.StoredViolations()) {
    legopt_msg::violation& reported = result.violations.emplace_back();
    reported.check = ToString(violation.check);
    reported.rule = ToString(violation.rule);
    reported.waypoint = violation.waypoint;
    reported.subject = violation.subject;
    reported.value = violation.value;
  }
  result.num_violations = static_cast<std::int32_t>(result.violations.size());
}

/// Adds the shortest time law of a timed motion; NaN if there is none.
void AddTiming(const Evaluation& evaluation, legopt_msg::result_request& result) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const bool timed = evaluation.timing && std::isfinite(evaluation.timing->shortest_s);
  const MotionTiming timing = timed ? *evaluation.timing : MotionTiming{};
  result.duration_s = timed ? timing.shortest_s : kNone;
  result.reduced_duration_s = timed && std::isfinite(timing.reduced_s) ? timing.reduced_s : kNone;
  result.velocity_limited_share = timed ? timing.limits.velocity : kNone;
  result.torque_limited_share = timed ? timing.limits.torque : kNone;
  result.contact_limited_share = timed ? timing.limits.contact : kNone;
}

}  // namespace

SolveExecutor::SolveExecutor(WorkerInputs inputs) : inputs_(std::move(inputs)) {}

std::vector<Capability> SolveExecutor::Load() {
  external_.emplace(inputs_.solvers);
  registry_ = external_->registry();
  std::vector<Capability> loaded;
  for (const std::filesystem::path& folder : inputs_.datasets) {
    const std::shared_ptr<const Dataset> dataset = Dataset::Load(folder, GuardedReader());
    if (!runners_.try_emplace(dataset->content_hash(), dataset, registry_).second) continue;  // same content as another
    loaded.push_back({dataset->name(), dataset->content_hash()});
  }
  for (const external::Declaration& declaration : external_->declarations()) {
    loaded.push_back({declaration.name, declaration.hash, CapabilityKind::kSolver});
  }
  for (const auto& [model, word] : kEnumNames<SceneRepresentation>) {
    loaded.push_back({std::string(word), {}, CapabilityKind::kCollision});
  }
  return loaded;
}

// Options that were valid when submitted but are invalid here belong to another build or another declaration.
const Method& SolveExecutor::ReadMethod(const std::string& hash, std::string_view options_json) try {
  if (const auto known = methods_.find(hash); known != methods_.end()) return known->second;
  const std::string source = "method " + hash;
  const nlohmann::json options = ParseJson(options_json, source);
  Method method = Method::FromCanonical(options, source, registry_);
  if (const std::string actual = method.Hash(); actual != hash) {
    throw InputError({source, "hash", actual, "the options do not have the hash that names them",
                      "run server, client and workers of the same release"});
  }
  if (methods_.size() >= kMaxCachedMethods) methods_.clear();
  return methods_.emplace(hash, std::move(method)).first->second;
} catch (const InputError& error) {
  throw JobRefused(error.what());
}

legopt_msg::result_request SolveExecutor::Execute(const legopt_msg::lease& lease, std::string_view options_json,
                                                  const Hooks& hooks) {
  const auto runner = runners_.find(lease.dataset_hash);
  if (runner == runners_.end()) {
    throw JobRefused("this worker has no dataset with content " + lease.dataset_hash +
                     "; start the worker with --dataset DIR");
  }
  Job job;
  job.task = ReadTask(lease.task, kLeaseSource);
  job.initialization = ReadInitialization(lease.initialization, kLeaseSource);
  job.problem_id = lease.problem_id;
  job.repetition = lease.repetition;
  job.experiment_seed = static_cast<std::uint64_t>(lease.experiment_seed);
  job.method = ReadMethod(lease.method_hash, options_json);
  job.effort_limit = lease.effort_limit;
  external_->set_memory_bytes(lease.memory_limit_bytes);
  job.wall_limit_s = static_cast<double>(lease.wall_limit_us) / kMicrosecondsPerSecond;
  try {
    legopt_msg::result_request result =
        ToMessage(runner->second.Run(job, {hooks.cancelled, hooks.progress, hooks.judging}));
    ChargeExternal(external_->TakeUsage(), result);
    return result;
  } catch (const external::SolverUnavailable& error) {
    throw JobRefused(error.what());
  }
}

legopt_msg::result_request ToMessage(const JobResult& job) {
  const SolveOutcome& solve = job.solve;
  const Evaluation& evaluation = job.evaluation;
  const ReportedOutcome outcome = OutcomeOf(solve);
  legopt_msg::result_request result =
      ResultWithoutSolution(outcome, outcome == ReportedOutcome::kTimeLimit ? StoppedByTheClock(solve) : solve.message);
  result.solver_status = ToString(solve.status);
  result.iterations = solve.iterations;
  result.restarts = solve.restarts;
  result.starts = solve.starts;
  result.term_evaluations = solve.term_evaluations;
  result.collision_queries = solve.collision_queries;
  result.work_ns = solve.work_ns;
  result.margin_relaxed = solve.margin_relaxed;
  result.wall_us = solve.wall_us;
  result.cpu_us = solve.cpu_us;
  result.involuntary_context_switches = solve.involuntary_context_switches;
  result.peak_memory_bytes = PeakMemoryBytes();
  result.solver_cost = solve.cost;
  result.solver_violation = solve.max_violation;
  result.verdict_literal = ToString(evaluation.literal);
  result.verdict_strict = ToString(evaluation.strict);
  result.verdict_solid = ToString(evaluation.solid);
  result.verdict_physical = ToString(evaluation.physical);
  result.verdict_detail = evaluation.detail;
  result.failed_waypoint = evaluation.failed_waypoint;
  result.cost = evaluation.cost;
  AddViolations(evaluation, result);
  result.interpolation_environment_depth_m = evaluation.interpolation.environment_depth_m;
  result.interpolation_self_depth_m = evaluation.interpolation.self_depth_m;
  result.interpolation_free_share = evaluation.interpolation.free_share;
  result.holding_postures = evaluation.holding.postures;
  result.holding_without_equilibrium = evaluation.holding.without_equilibrium;
  result.holding_over_torque = evaluation.holding.over_torque;
  result.halfway_postures = evaluation.holding_halfway.postures;
  result.halfway_without_equilibrium = evaluation.holding_halfway.without_equilibrium;
  result.halfway_over_torque = evaluation.holding_halfway.over_torque;
  AddTiming(evaluation, result);
  result.windows = solve.windows;
  result.windows_solved = solve.windows_solved;
  if (OneShape(solve.waypoints)) {
    result.num_waypoints = static_cast<std::int32_t>(solve.waypoints.size());
    result.waypoint_size = static_cast<std::int32_t>(solve.waypoints.front().size());
    for (const Eigen::VectorXd& x : solve.waypoints)
      result.waypoints.insert(result.waypoints.end(), x.begin(), x.end());
  }
  if (solve.unsolved) AddUnsolved(job, result);
  result.trace = EncodeTrace(CondenseTrace(solve.history));
  return result;
}

}  // namespace legopt::worker

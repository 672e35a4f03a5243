#include "client/compare/solves.h"

#include <algorithm>
#include <map>
#include <utility>

#include "client/report/benchmark_table.h"
#include "client/report/reading.h"
#include "db/named_queries.h"
#include "legopt/types/check.h"
#include "legopt/types/job.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

using statistics::RunOutcome;

constexpr double kMicrosecondsPerMs = 1e3;

RunOutcome EndOf(JobState state, bool solved) {
  switch (state) {
    case JobState::kDone:
      return solved ? RunOutcome::kSolved : RunOutcome::kFailed;
    case JobState::kFailed:
    case JobState::kDead:
      return RunOutcome::kFailed;
    default:
      return RunOutcome::kMissing;
  }
}

// Reads a row of the statement below.
Solve SolveAt(const Listing& jobs, std::size_t row, double limit_ms) {
  Solve solve;
  solve.job_id = jobs.At(row, "job_id").get<std::int64_t>();
  solve.problem = jobs.At(row, "problem_id").get<int>();
  solve.waypoints = jobs.At(row, "num_waypoints").get<int>();
  solve.reported = !jobs.At(row, "wall_us").is_null();
  const bool solved = solve.reported && jobs.At(row, "solved").get<int>() == 1;
  solve.end = EndOf(jobs.EnumAt<JobState>(row, "state"), solved);
  solve.time_ms = limit_ms;
  if (!solve.reported) return solve;
  const auto wall_us = jobs.At(row, "wall_us").get<std::int64_t>();
  const auto cpu_us = jobs.At(row, "cpu_us").get<std::int64_t>();
  solve.contended = Contended(wall_us, cpu_us, jobs.At(row, "involuntary_context_switches").get<std::int64_t>());
  solve.cpu_ms = static_cast<double>(cpu_us) / kMicrosecondsPerMs;
  solve.time_ms = static_cast<double>(cpu_us > 0 ? cpu_us : wall_us) / kMicrosecondsPerMs;
  if (const auto& work_ns = jobs.At(row, "work_ns"); !work_ns.is_null()) {
    constexpr double kNanosecondsPerMs = 1e6;
    solve.work_ms = work_ns.get<double>() / kNanosecondsPerMs;
  }
  solve.stopped = EndedByLimit(jobs.EnumAt<SolveStatus>(row, "solver_status"));
  if (const auto& starts = jobs.At(row, "further_starts"); !starts.is_null()) {
    solve.further_starts = std::max(starts.get<std::int64_t>(), std::int64_t{0});
  }
  if (!solved) return solve;
  solve.cost = jobs.At(row, "cost").get<double>();
  if (const auto& used = jobs.At(row, "tolerance_used"); !used.is_null()) solve.tolerance_used = used.get<double>();
  return solve;
}

// Returns the names of the checks whose measure is 0 if the constraint holds exactly, of the benchmark's tolerance.
std::vector<std::string_view> ChecksWithTolerance() {
  std::vector<std::string_view> names;
  for (const CheckDescription& check : kChecks) {
    if (check.measured() && check.tolerance == kPoseTolerance) names.push_back(check.name);
  }
  return names;
}

// Returns the names of a rule and of the more lenient ones.
std::vector<std::string_view> RulesUpTo(Rule rule) {
  std::vector<std::string_view> names;
  for (const auto& name : kEnumNames<Rule>) {
    if (name.value <= rule) names.push_back(ToString(name.value));
  }
  return names;
}

}  // namespace

bool Contended(std::int64_t wall_us, std::int64_t cpu_us, std::int64_t involuntary_context_switches) {
  constexpr double kMaxWallOverCpu = 1.2;
  return involuntary_context_switches > 0 ||
         static_cast<double>(wall_us) > kMaxWallOverCpu * static_cast<double>(cpu_us);
}

bool EndedByLimit(SolveStatus status) {
  return status == SolveStatus::kIterationLimit || status == SolveStatus::kEffortLimit ||
         status == SolveStatus::kTimeLimit;
}

std::vector<MethodIdentity> SolvedExperiment::Methods() const {
  std::vector<MethodIdentity> methods;
  for (const SolveCell& cell : cells) {
    const auto same = [&](const MethodIdentity& method) { return method.method_id == cell.method.method_id; };
    if (std::none_of(methods.begin(), methods.end(), same)) methods.push_back(cell.method);
  }
  return methods;
}

SolvedExperiment ReadCells(ResultSource& source, std::optional<std::int64_t> experiment) {
  SolvedExperiment read;
  read.info = FindExperiment(source, experiment);
  const Listing cells = source.Query(db::Sql(db::Query::kSolveCells, {{"experiment_id", read.info.id}}));
  for (std::size_t i = 0; i < cells.rows.size(); ++i) {
    read.seed = cells.At(i, "seed").get<std::int64_t>();
    read.repetitions = cells.At(i, "repetitions").get<std::int64_t>();
    SolveCell& cell = read.cells.emplace_back();
    cell.cell_id = cells.At(i, "cell_id").get<std::int64_t>();
    cell.method = MethodAt(cells, i);
    cell.num_jobs = cells.At(i, "num_jobs").get<std::int64_t>();
    cell.column = {cells.EnumAt<Task>(i, "task"), cells.EnumAt<Initialization>(i, "initialization")};
    cell.effort_limited = cells.At(i, "effort_limited").get<int>() != 0;
    cell.limit_ms = cells.At(i, "wall_limit_us").get<double>() / kMicrosecondsPerMs;
  }
  read.origins = ReadOrigins(source, read.info.id);
  read.clock_stopped = source.Query(db::Sql(db::Query::kClockStoppedCount, {{"experiment_id", read.info.id}}))
                           .At(0, "n")
                           .get<std::int64_t>();
  read.taken_over = CountReusedResults(source, read.info.id);
  return read;
}

void KeepCells(const KeptCells& kept, SolvedExperiment* experiment) {
  std::erase_if(experiment->cells,
                [&](const SolveCell& cell) { return !kept.Keeps(cell.method.method_id, cell.column); });
}

void ReadSolves(ResultSource& source, Rule rule, SolvedExperiment* experiment) {
  RequireVerdicts(source, experiment->info, rule);
  std::int64_t num_jobs = 0;
  for (const SolveCell& cell : experiment->cells) num_jobs += cell.num_jobs;
  source.AnnounceJobs(num_jobs, experiment->info.id);
  for (SolveCell& cell : experiment->cells) {
    const Listing jobs = source.Query(db::Sql(db::Query::kSolvesOfCell, {{"cell_id", cell.cell_id},
                                                                         {"rule", rule},
                                                                         {"checks", ChecksWithTolerance()},
                                                                         {"rules", RulesUpTo(rule)},
                                                                         {"tolerance", FormatNumber(kPoseTolerance)}}));
    cell.solves.clear();
    cell.solves.reserve(jobs.rows.size());
    for (std::size_t i = 0; i < jobs.rows.size(); ++i) cell.solves.push_back(SolveAt(jobs, i, cell.limit_ms));
  }
}

std::vector<ProblemRuns> ProblemsOf(const SolveCell& cell) {
  std::vector<ProblemRuns> problems;
  const auto add_up = [&] {
    if (problems.empty()) return;
    ProblemRuns& runs = problems.back();
    runs.time = statistics::ScoreOf(runs.runs);
    runs.cost = statistics::ScoreOf(runs.cost_runs);
    runs.work = statistics::ScoreOf(runs.work_runs);
    runs.tolerance = statistics::ScoreOf(runs.tolerance_runs);
  };
  for (const Solve& solve : cell.solves) {
    if (problems.empty() || problems.back().problem != solve.problem) {
      add_up();
      ProblemRuns& runs = problems.emplace_back();
      runs.problem = solve.problem;
      runs.waypoints = solve.waypoints;
      runs.job_id = solve.job_id;
    }
    problems.back().runs.push_back({solve.end, solve.time_ms});
    problems.back().cost_runs.push_back({solve.end, solve.cost});
    problems.back().work_runs.push_back({solve.end, solve.work_ms});
    problems.back().tolerance_runs.push_back(
        {solve.end, std::max(solve.tolerance_used.value_or(0.0), kLeastTolerance)});
    problems.back().tolerance_known &= solve.end != RunOutcome::kSolved || solve.tolerance_used.has_value();
    problems.back().work_counted &= solve.end != RunOutcome::kSolved || solve.work_ms > 0.0;
  }
  add_up();
  return problems;
}

ProblemMap ProblemMapOf(const SolveCell& cell) {
  ProblemMap problems;
  for (ProblemRuns& runs : ProblemsOf(cell)) {
    const int number = runs.problem;
    problems.emplace(number, std::move(runs));
  }
  return problems;
}

CompleteProblems FindCompleteProblems(std::span<const ProblemMap> methods) {
  CompleteProblems complete;
  std::map<int, std::size_t> methods_of;  // number of methods that have completed a problem
  for (const ProblemMap& method : methods) {
    bool any = false;
    for (const auto& [number, runs] : method) {
      if (!runs.complete()) continue;
      ++methods_of[number];
      any = true;
    }
    complete.shown.push_back(any);
  }
  const auto all = static_cast<std::size_t>(std::ranges::count(complete.shown, true));
  for (const auto& [number, count] : methods_of) {
    if (count == all) complete.problems.push_back(number);
  }
  return complete;
}

namespace {

Charge ChargeOf(std::span<const SolveCell> cells, Task task) {
  std::optional<double> limit_ms;
  for (const SolveCell& cell : cells) {
    if (cell.column.task != task) continue;
    if (cell.effort_limited) return {kPenaltyFactor * kLimitPerWaypoint_ms, ChargeRule::kPerWaypoint};
    limit_ms = std::min(limit_ms.value_or(cell.limit_ms), cell.limit_ms);
  }
  return {kPenaltyFactor * limit_ms.value_or(0.0), ChargeRule::kWallLimit};
}

}  // namespace

double Charge::Apply(const ProblemRuns& problem) const {
  return problem.time.Charged(rule == ChargeRule::kPerWaypoint ? ms * problem.waypoints : ms);
}

EnumArray<Task, Charge> ChargesOf(std::span<const SolveCell> cells, std::optional<double> chosen_ms) {
  EnumArray<Task, Charge> charges;
  for (const TaskDescription& description : kTasks) {
    charges[description.task] = chosen_ms ? Charge{*chosen_ms, ChargeRule::kChosen} : ChargeOf(cells, description.task);
  }
  return charges;
}

std::string DescribeCharge(const Charge& charge, const TimeUnit& unit) {
  constexpr double kMillisecondsPerSecond = 1e3;
  const std::string time = FormatTime(charge.ms / kMillisecondsPerSecond, unit) + " " + unit.name;
  switch (charge.rule) {
    case ChargeRule::kChosen:
      return time + ", as chosen";
    case ChargeRule::kPerWaypoint:
      return time + " for each waypoint of the problem";
    case ChargeRule::kWallLimit:
      return time + ", ten times the limit of wall time";
  }
  return time;
}

const char* EnumNameOf(ChargeRule rule) {
  switch (rule) {
    case ChargeRule::kChosen:
      return "chosen";
    case ChargeRule::kPerWaypoint:
      return "per_waypoint";
    case ChargeRule::kWallLimit:
      return "wall_limit";
  }
  return "";
}

const char* TitleOfChargedMean(ChargeRule rule) { return rule == ChargeRule::kChosen ? "Charged" : "PAR10"; }

}  // namespace legopt::client

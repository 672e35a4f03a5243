#include "test_database.h"

#include <stdlib.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <variant>

#include "db/connection.h"
#include "db/read_only_database.h"
#include "db/sqlite_store.h"

namespace legopt::client {
namespace {

constexpr std::int64_t kWorker = 1;
constexpr std::int64_t kNow_us = 1'700'000'000'000'000;

db::ResultRecord RecordOf(const TestResult& result, int num_waypoints) {
  db::ResultRecord record;
  const auto verdict = ParseEnum<Verdict>(result.verdict).value();
  const bool success = verdict == Verdict::kSuccess;
  record.solver_status = success ? SolveStatus::kConvergedFeasible : SolveStatus::kConvergedInfeasible;
  if (result.status != SolveStatus::kNotRun) record.solver_status = result.status;
  record.wall_us = result.wall_us;
  record.cpu_us = result.cpu_us < 0 ? result.wall_us : result.cpu_us;
  record.work_ns = result.work_ns;
  record.involuntary_context_switches = result.switches;
  record.verdict_literal = record.verdict_strict = record.verdict_solid = record.verdict_physical = verdict;
  record.verdict_detail = success ? "" : "made up";
  record.cost = success ? result.cost : std::nan("");
  record.num_waypoints = num_waypoints;
  record.trace = result.trace;
  record.violations = result.violations;
  record.starts = static_cast<int>(result.starts);
  if (!result.waypoints.empty()) {
    record.waypoint_size = static_cast<int>(result.waypoints.front().size());
    for (const auto& x : result.waypoints)
      record.waypoints.insert(record.waypoints.end(), x.data(), x.data() + x.size());
  }
  if (verdict != Verdict::kWindowUnsolved) return record;
  record.windows = 3;
  record.windows_solved = 1;
  record.window_verdict = Verdict::kFootPose;
  record.first_unsolved = result.first_unsolved;
  record.num_unsolved = static_cast<int>(result.unsolved.size());
  for (const auto& x : result.unsolved) record.unsolved.insert(record.unsolved.end(), x.begin(), x.end());
  return record;
}

db::NewExperiment DescriptionOf(const TestExperiment& experiment) {
  db::NewExperiment description;
  description.experiment_id = 1;
  description.submission_id = "test";
  description.name = experiment.name;
  description.spec_json = "{}";
  description.rule = experiment.rule;
  description.spec_hash = std::string(64, 'b');
  description.seed = 1;
  description.wall_limit_us = experiment.wall_limit_us;
  for (const auto& result : experiment.results) {
    description.repetitions = std::max(description.repetitions, result.repetition + 1);
  }
  description.memory_limit_bytes = 1 << 30;
  description.submitted_at_us = kNow_us;
  description.dataset = {experiment.dataset_name, experiment.dataset_hash};
  for (std::size_t i = 0; i < experiment.methods.size(); ++i) {
    const int original = experiment.methods[i].copy_of;
    const std::string hash(64, static_cast<char>('0' + (original < 0 ? static_cast<int>(i) : original)));
    description.methods.push_back({experiment.methods[i].name, hash, experiment.methods[i].options,
                                   experiment.methods[i].multi_starts, 100, false,
                                   ParseEnum<SceneRepresentation>(experiment.methods[i].collision).value()});
  }
  const auto task = ParseEnum<Task>(experiment.task).value();
  std::map<std::pair<int, std::string>, int> cells;
  std::map<int, int> problems;
  std::int64_t job_id = 0;
  for (const auto& result : experiment.results) {
    const auto [cell, new_cell] =
        cells.try_emplace({result.method, result.initialization}, static_cast<int>(description.cells.size()));
    if (new_cell) {
      description.cells.push_back({static_cast<std::int64_t>(description.cells.size()) + 1, result.method, task,
                                   ParseEnum<Initialization>(result.initialization).value(), 0});
    }
    description.cells.back().effort_limit = experiment.effort_limit;
    ++description.cells[static_cast<std::size_t>(cell->second)].num_jobs;
    const auto [problem, new_problem] =
        problems.try_emplace(result.problem, static_cast<int>(description.problems.size()));
    if (new_problem) description.problems.push_back({task, result.problem, experiment.num_waypoints});
    description.jobs.push_back({++job_id, cell->second, problem->second, result.repetition});
  }
  return description;
}

}  // namespace

void WriteTestDatabase(const std::filesystem::path& file, const TestExperiment& experiment) {
  const auto store = db::OpenSqliteStore(file);
  const std::string& text = experiment.text;
  const auto said = [&text](const char* usual) { return text.empty() ? std::string(usual) : text; };
  std::vector<db::StoreOp> operations = {
      db::CreateExperiment{DescriptionOf(experiment)},
      db::PutWorker{{kWorker, 99, said("worker-1"), said("host"), 1, 1, said("build"), experiment.build_id,
                     said("processor"), 2, std::int64_t{1} << 30, 0.5, kNow_us}}};
  std::int64_t job_id = 0;
  bool all_finished = true;
  for (const auto& result : experiment.results) {
    ++job_id;
    all_finished = all_finished && result.finished;
    if (!result.finished) continue;
    operations.emplace_back(db::LeaseJob{job_id, 1, job_id, kWorker, kNow_us});
    if (result.dead) {
      operations.emplace_back(db::EndAttempt{job_id, 1, AttemptOutcome::kCrashed, JobState::kDead, 11, "it crashed",
                                             "the last line\n", kNow_us + 2'000'000});
      operations.emplace_back(db::RecordEvent{"job_dead", kNow_us + 2'000'000, 1, job_id, {}, "crashed: it crashed"});
      continue;
    }
    db::ResultRecord record = RecordOf(result, experiment.num_waypoints);
    if (!text.empty()) record.verdict_detail = text;
    operations.emplace_back(db::AcceptResult{job_id, 1, std::move(record), text, text, kNow_us});
  }
  if (all_finished) operations.emplace_back(db::FinishExperiment{1, kNow_us});
  store->Apply(operations);
}

void AlterDatabase(const std::filesystem::path& file, const std::string& trigger, const std::string& change) {
  const auto kept = db::ReadOnlyDatabase(file).Query(
      "SELECT sql FROM sqlite_schema WHERE type = 'trigger' AND name = '" + trigger + "'", {}, {});
  db::Connection connection(file, db::Connection::Mode::kReadWriteCreate);
  if (!kept.rows.empty()) connection.Execute("DROP TRIGGER " + trigger);
  connection.Execute(change);
  if (!kept.rows.empty()) connection.Execute(std::get<std::string>(kept.rows[0][0]));
}

}  // namespace legopt::client

#include "client/archive/archive_database.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <system_error>
#include <tuple>
#include <utility>
#include <vector>

#include "app/folder_cache.h"
#include "client/suite/experiment_spec.h"
#include "db/backup.h"
#include "db/sqlite_store.h"
#include "legopt/dataset/internal/dataset_content.h"
#include "legopt/files/temporary_folder.h"
#include "legopt/input/json.h"
#include "legopt/math/blake2b.h"
#include "legopt/types/input_error.h"

namespace legopt::client {
namespace {

constexpr std::size_t kOpsPerCommit = 5'000;
constexpr double kMicrosecondsPerSecond = 1e6;
constexpr std::int64_t kMemoryLimit_mb = 2048;

std::int64_t Now_us() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::microseconds>(now).count();
}

// The specification of the archive's experiment, as for a submission (client/suite/experiment_spec.h).
nlohmann::json SpecOf(const Archive& archive, const DatasetFacts& facts,
                      const std::vector<db::ProblemRecord>& problems) {
  auto tasks = nlohmann::json::array(), methods = nlohmann::json::array(), words = nlohmann::json::array();
  auto wall_s = nlohmann::json::object(), effort = nlohmann::json::object();
  for (const ArchivedTask& task : archive.tasks) {
    auto waypoints = nlohmann::json::array();
    for (const db::ProblemRecord& problem : problems) {
      if (problem.task == task.task) waypoints.push_back(problem.waypoints);
    }
    const std::string word(ToString(task.task));
    tasks.push_back({{"task", word}, {"problems", task.problems}, {"waypoints", std::move(waypoints)}});
    wall_s[word] = DescriptionOf(task.task).default_wall_limit_s;
    effort[word] = DescriptionOf(task.task).default_effort_limit;
  }
  for (const ArchivedMethod& method : archive.methods) {
    const auto options = ParseJson(method.options, "options of " + method.name);
    methods.push_back({{"name", method.name},
                       {"hash", method.hash},
                       {"options", options},
                       {"multi_starts", method.multi_starts},
                       {"sample_size", method.sample_size},
                       {"incremental", options.value("incremental", false)}});
  }
  for (const Initialization initialization : archive.initializations) words.push_back(ToString(initialization));
  nlohmann::json spec = {
      {"spec_version", 1},
      {"name", archive.experiment},
      {"seed", archive.seed},
      {"repetitions", archive.repetitions},
      {"dataset", {{"name", facts.name}, {"hash", archive.dataset_hash}, {"joint_names", facts.joint_names}}},
      {"tasks", std::move(tasks)},
      {"initializations", std::move(words)},
      {"methods", std::move(methods)},
      {"limits", {{"effort_limit", effort}, {"wall_time_s", wall_s}, {"memory_mb", kMemoryLimit_mb}}},
      {"max_attempts", 1},
      {"builds", ToString(BuildPolicy::kAny)}};
  if (archive.rule != Rule::kSolid) spec["rule"] = ToString(archive.rule);
  return spec;
}

std::vector<db::ProblemRecord> ProblemsOf(const Archive& archive, const Dataset& dataset) {
  std::vector<db::ProblemRecord> problems;
  for (const ArchivedTask& task : archive.tasks) {
    for (const int id : task.problems) {
      const auto stances = static_cast<int>(dataset.problem(task.task, id).stances.size());
      problems.push_back({task.task, id, NumWaypoints(task.task, stances)});
    }
  }
  return problems;
}

db::MethodRecord MethodOf(const ArchivedMethod& method) {
  const auto options = ParseJson(method.options, "options of " + method.name);
  db::MethodRecord record;
  record.name = method.name;
  record.hash = method.hash;
  record.options_json = Dump(options);
  record.multi_starts = method.multi_starts;
  record.sample_size_percent = method.sample_size;
  record.incremental = options.value("incremental", false);
  const auto solver = options.find("options");
  const std::string model = solver == options.end() ? "" : solver->value("collision", "");
  record.collision = ParseEnum<SceneRepresentation>(model).value_or(SceneRepresentation::kSolid);
  return record;
}

// Numbers of the rows that an archive adds.
struct Numbering {
  std::int64_t experiment = 0, job = 0, cell = 0, worker = 0;
};

// Adds cells and jobs in the order of JobIds.
void AddJobs(const Archive& archive, const Numbering& first, db::NewExperiment* rows) {
  db::NewExperiment& experiment = *rows;
  for (std::size_t method = 0; method < archive.methods.size(); ++method) {
    int next_problem = 0;  // index of the task's first problem
    for (const ArchivedTask& task : archive.tasks) {
      const auto num_problems = static_cast<int>(task.problems.size());
      for (const Initialization initialization : archive.initializations) {
        const TaskDescription& description = DescriptionOf(task.task);
        const auto wall_us = std::llround(kMicrosecondsPerSecond * description.default_wall_limit_s);
        const auto cell = static_cast<int>(experiment.cells.size());
        experiment.cells.push_back({first.cell + cell, static_cast<int>(method), task.task, initialization,
                                    std::int64_t{num_problems} * archive.repetitions, wall_us,
                                    description.default_effort_limit});
        experiment.wall_limit_us = std::max<std::int64_t>(experiment.wall_limit_us, wall_us);
        for (int problem = 0; problem < num_problems; ++problem) {
          for (int repetition = 0; repetition < archive.repetitions; ++repetition) {
            const auto id = first.job + static_cast<std::int64_t>(experiment.jobs.size());
            experiment.jobs.push_back({id, cell, next_problem + problem, repetition});
          }
        }
      }
      next_problem += num_problems;
    }
  }
}

db::NewExperiment RowsOf(const Archive& archive, const Dataset& dataset, const Numbering& first) {
  constexpr std::int64_t kBytesPerMb = std::int64_t{1} << 20;
  db::NewExperiment experiment;
  const DatasetFacts facts = FactsOf(dataset);
  experiment.problems = ProblemsOf(archive, dataset);
  const nlohmann::json spec = SpecOf(archive, facts, experiment.problems);
  experiment.experiment_id = first.experiment;
  experiment.submission_id = archive.hash + " " + std::to_string(first.experiment);
  experiment.name = archive.experiment;
  experiment.spec_json = Dump(spec);
  experiment.spec_hash = Blake2bHex(experiment.spec_json);
  experiment.builds = BuildPolicy::kAny;
  experiment.rule = archive.rule;
  experiment.seed = archive.seed;
  experiment.repetitions = archive.repetitions;
  experiment.max_attempts = 1;
  experiment.memory_limit_bytes = kMemoryLimit_mb * kBytesPerMb;
  experiment.submitted_at_us = Now_us();
  experiment.dataset = {facts.name, archive.dataset_hash, facts.joint_names};
  for (const ArchivedMethod& method : archive.methods) experiment.methods.push_back(MethodOf(method));
  AddJobs(archive, first, &experiment);
  return experiment;
}

void RecordEvaluation(const Evaluation& evaluation, db::ResultRecord* record) {
  record->verdict_detail = evaluation.detail;
  record->failed_waypoint = evaluation.failed_waypoint;
  record->violations = evaluation.StoredViolations();
  record->interpolation_environment_depth_m = evaluation.interpolation.environment_depth_m;
  record->interpolation_self_depth_m = evaluation.interpolation.self_depth_m;
  record->interpolation_free_share = evaluation.interpolation.free_share;
  record->holding_postures = evaluation.holding.postures;
  record->holding_without_equilibrium = evaluation.holding.without_equilibrium;
  record->holding_over_torque = evaluation.holding.over_torque;
  record->halfway_postures = evaluation.holding_halfway.postures;
  record->halfway_without_equilibrium = evaluation.holding_halfway.without_equilibrium;
  record->halfway_over_torque = evaluation.holding_halfway.over_torque;
  if (!evaluation.timing || !std::isfinite(evaluation.timing->shortest_s)) return;
  record->duration_s = evaluation.timing->shortest_s;
  record->reduced_duration_s = evaluation.timing->reduced_s;
  record->velocity_limited_share = evaluation.timing->limits.velocity;
  record->torque_limited_share = evaluation.timing->limits.torque;
  record->contact_limited_share = evaluation.timing->limits.contact;
}

void RecordWaypoints(const std::vector<Eigen::VectorXd>& waypoints, db::ResultRecord* record) {
  const bool same = std::ranges::all_of(
      waypoints, [&](const Eigen::VectorXd& x) { return x.size() == waypoints.front().size() && x.size() > 0; });
  if (waypoints.empty() || !same) return;
  record->waypoint_size = static_cast<int>(waypoints.front().size());
  for (const Eigen::VectorXd& x : waypoints) record->waypoints.insert(record->waypoints.end(), x.begin(), x.end());
}

db::ResultRecord RecordOf(const ArchivedResult& result, const JudgedResult& judged, int num_waypoints) {
  db::ResultRecord record;
  record.solver_status = result.status;
  record.cpu_us = result.cpu_us;
  record.wall_us = result.cpu_us;
  record.work_ns = result.work_ns;
  record.term_evaluations = result.evaluations;
  record.collision_queries = result.collision_queries;
  record.iterations = static_cast<int>(result.iterations);
  record.restarts = static_cast<int>(result.restarts);
  record.windows = static_cast<int>(result.windows);
  record.windows_solved = static_cast<int>(result.windows_solved);
  record.window_verdict = result.window_verdict;
  record.starts = static_cast<int>(result.starts);
  record.margin_relaxed = result.margin_relaxed;
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  record.solver_cost = result.solver_cost.value_or(kUnknown);
  record.solver_violation = result.solver_violation.value_or(kUnknown);
  // A failure by one rule is a failure by all stricter rules. So a missing verdict is replaced by that of the most
  // lenient rule with a verdict.
  std::optional<Verdict> known;
  for (const auto& [rule, word] : kEnumNames<Rule>) {
    if (!known) known = judged.verdicts[rule];
  }
  const auto verdict = [&](Rule rule) {
    return judged.verdicts[rule].value_or(known.value_or(Verdict::kWrongWaypointCount));
  };
  record.verdict_literal = verdict(Rule::kLiteral);
  record.verdict_strict = verdict(Rule::kStrict);
  record.verdict_solid = verdict(Rule::kSolid);
  record.verdict_physical = verdict(Rule::kPhysical);
  record.cost = judged.cost.value_or(kUnknown);
  record.num_waypoints = num_waypoints;
  if (judged.evaluation) RecordEvaluation(*judged.evaluation, &record);
  RecordWaypoints(result.waypoints, &record);
  if (const std::string fault = db::FaultOf(record); !fault.empty()) {
    throw InputError({"archive",
                      "result of " + std::string(ToString(result.task)) + " " + std::to_string(result.problem),
                      {},
                      fault,
                      "pack the archive again with 'legopt archive pack'"});
  }
  return record;
}

/// Collects operations and applies many in one transaction.
class Batches {
 public:
  explicit Batches(db::Store* store) : store_(store) {}

  void Add(db::StoreOp op) {
    ops_.push_back(std::move(op));
    if (ops_.size() >= kOpsPerCommit) Apply();
  }
  void Apply() {
    store_->Apply(ops_);
    ops_.clear();
  }

 private:
  db::Store* store_;
  std::vector<db::StoreOp> ops_;
};

// Adds a worker for each build.
void AddWorkers(const Archive& archive, std::int64_t first_worker, Batches* batches) {
  for (std::size_t i = 0; i < archive.builds.size(); ++i) {
    db::WorkerRecord worker;
    worker.worker_id = worker.endpoint = first_worker + static_cast<std::int64_t>(i);
    worker.name = "archive";
    worker.processors = 0;
    worker.build = archive.builds[i].text;
    worker.build_id = archive.builds[i].id;
    worker.processor = archive.builds[i].processor;
    worker.seen_at_us = Now_us();
    batches->Add(db::PutWorker{worker});
  }
}

void AddResults(const Archive& archive, const JudgedArchive& judged, const db::NewExperiment& rows,
                const Numbering& first, Batches* batches) {
  const std::map<JobKey, std::int64_t> ids = JobIds(archive);
  std::map<std::int64_t, std::size_t> result_of;  // index of each job's result
  for (std::size_t i = 0; i < archive.results.size(); ++i) {
    const ArchivedResult& result = archive.results[i];
    result_of[first.job - 1 +
              ids.at({result.method, result.task, result.initialization, result.problem, result.repetition})] = i;
  }
  const std::int64_t at_us = Now_us();
  for (const db::NewJob& job : rows.jobs) {
    const auto found = result_of.find(job.job_id);
    const std::size_t build = found == result_of.end() ? 0 : archive.results[found->second].build;
    batches->Add(db::LeaseJob{job.job_id, 1, job.job_id, first.worker + static_cast<std::int64_t>(build), at_us});
    if (found == result_of.end()) {
      db::EndAttempt end;
      end.job_id = job.job_id;
      end.attempt = 1;
      end.outcome = AttemptOutcome::kError;
      end.next = JobState::kFailed;
      end.message = "the archive has no result of this job";
      end.at_us = at_us;
      batches->Add(end);
      continue;
    }
    const db::ProblemRecord& problem = rows.problems[static_cast<std::size_t>(job.problem_index)];
    batches->Add(db::AcceptResult{
        job.job_id, 1, RecordOf(archive.results[found->second], judged.results[found->second], problem.waypoints), "",
        "", at_us});
  }
}

}  // namespace

std::map<JobKey, std::int64_t> JobIds(const Archive& archive) {
  std::map<JobKey, std::int64_t> ids;
  for (std::size_t method = 0; method < archive.methods.size(); ++method) {
    for (const ArchivedTask& task : archive.tasks) {
      for (const Initialization initialization : archive.initializations) {
        for (const int problem : task.problems) {
          for (int repetition = 0; repetition < archive.repetitions; ++repetition) {
            ids.emplace(JobKey{method, task.task, initialization, problem, repetition}, std::ssize(ids) + 1);
          }
        }
      }
    }
  }
  return ids;
}

ArchiveDatabase::ArchiveDatabase() : folder_(files::CreateTemporaryFolder("legopt-archive-")) {
  store_ = db::OpenSqliteStore(folder_ / "results.sqlite");
}

ArchiveDatabase::~ArchiveDatabase() {
  store_.reset();
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

std::int64_t ArchiveDatabase::Add(const Archive& archive, const JudgedArchive& judged, const Dataset& dataset) {
  const db::OpenState state = store_->LoadOpenState();
  const Numbering first{state.next_experiment_id, state.next_job_id, state.next_cell_id, state.next_worker_id};
  const db::NewExperiment rows = RowsOf(archive, dataset, first);
  Batches batches(store_.get());
  batches.Add(db::CreateExperiment{rows});
  batches.Add(db::StoreDataset{archive.dataset_hash, PackDataset(dataset.folder(), GuardedReader())});
  AddWorkers(archive, first.worker, &batches);
  AddResults(archive, judged, rows, first, &batches);
  batches.Add(db::FinishExperiment{first.experiment, Now_us()});
  batches.Apply();
  return first.experiment;
}

void ArchiveDatabase::Finish(const std::filesystem::path& file) {
  store_.reset();
  db::BackUp(folder_ / "results.sqlite", file);
}

}  // namespace legopt::client

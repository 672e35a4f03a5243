#include "client/replay/stored_job.h"

#include <algorithm>
#include <map>
#include <optional>
#include <random>
#include <span>
#include <string>

#include "client/client_error.h"
#include "db/named_queries.h"
#include "legopt/input/json.h"
#include "legopt/planning/internal/trace.h"
#include "legopt/types/input_error.h"

namespace legopt::client {
namespace {

[[noreturn]] void RefuseTrace(std::int64_t job, const std::string& what) {
  throw ClientError(ExitCode::kUsage, "job " + std::to_string(job) + " " + what);
}

Listing HistoryOf(const std::string& text, std::int64_t job) {
  const auto json = TryParseJson(text).value_or(nullptr);
  Listing listing;
  const bool whole = json.is_object() && json.contains("columns") && json.contains("rows") &&
                     json.at("columns").is_array() && json.at("rows").is_array();
  if (!whole) RefuseTrace(job, "has an unreadable history: " + text.substr(0, 80));
  for (const auto& column : json.at("columns")) listing.columns.push_back(column.get<std::string>());
  for (const auto& row : json.at("rows")) {
    if (!row.is_array() || row.size() != listing.columns.size()) RefuseTrace(job, "has a history with a damaged row");
    listing.rows.emplace_back(row.begin(), row.end());
  }
  return listing;
}

}  // namespace

std::vector<IterationRecord> TraceRecords(const Listing& row, std::int64_t job) {
  if (row.At(0, "trace").is_null()) return {};
  const std::string source = "job " + std::to_string(job);
  const std::optional<std::string> bytes = BlobAt(row, 0, "trace");
  if (bytes && bytes->empty()) return {};
  try {
    if (!bytes) throw InputError({source, "trace", "", "is no BLOB", std::string(kCheckDatabase)});
    return DecodeTrace({reinterpret_cast<const std::uint8_t*>(bytes->data()), bytes->size()}, source);
  } catch (const InputError& error) {
    throw ClientError(ExitCode::kDatabaseUnusable, error.what());
  }
}

StoredTrace ReadTrace(ResultSource& source, std::int64_t job) {
  const std::string id = std::to_string(job);
  const Listing found = source.Query(db::Sql(db::Query::kTraceOfJob, {{"job_id", job}}));
  if (found.rows.empty()) RefuseTrace(job, "does not exist; 'legopt list" + source.flags() + "' lists those that do");
  if (found.At(0, "job_id").is_null()) {
    RefuseTrace(job, "is " + found.Text(0, "state") + " and has no result; 'legopt show " + id + source.flags() +
                         "' shows what happened");
  }
  StoredTrace trace;
  const auto& history = found.At(0, "history_json");
  trace.records = TraceRecords(found, job);
  if (trace.records.empty() && history.is_string()) {
    trace.history = HistoryOf(history.get<std::string>(), job);
  } else if (trace.records.empty()) {
    RefuseTrace(job, "has a result without a trace: its solver took no step, or tells none");
  }
  return trace;
}

Listing TraceListing(const std::vector<IterationRecord>& records) {
  Listing listing;
  listing.columns = {"step",     "window",      "restart",    "start", "penalty",  "trust_box",
                     "accepted", "evaluations", "elapsed_us", "cost",  "violation"};
  for (const IterationRecord& record : records) {
    listing.rows.push_back({record.step, record.window, record.restart, record.start, record.penalty, record.trust_box,
                            record.accepted ? 1 : 0, record.evaluations, record.elapsed_us, record.cost,
                            record.violation});
  }
  return listing;
}

namespace {

// Returns whether a result is reproducible: neither a user nor the wall-time limit stopped the solve.
constexpr bool IsRepeatable(SolveStatus status) {
  return status != SolveStatus::kTimeLimit && status != SolveStatus::kCancelled && status != SolveStatus::kNotRun;
}

std::vector<SolveStatus> RepeatableStatuses() {
  std::vector<SolveStatus> statuses;
  for (const auto& row : kEnumNames<SolveStatus>) {
    if (IsRepeatable(row.value)) statuses.push_back(row.value);
  }
  return statuses;
}

template <class Number>
std::optional<Number> OptionalAt(const Listing& row, const char* column) {
  const nlohmann::json& value = row.At(0, column);
  return value.is_null() ? std::nullopt : std::optional(value.get<Number>());
}

// Throws unless the solver is in the registry; external solvers need a description file.
void RequireSolver(const nlohmann::json& options, const std::string& source, const SolverRegistry& registry) {
  const auto solver = options.is_object() ? options.find("solver") : options.end();
  if (solver == options.end() || !solver->is_string() || registry.Find(solver->get<std::string>()) != nullptr) return;
  throw ClientError(ExitCode::kUsage, source + " was solved by '" + solver->get<std::string>() +
                                          "', which is no solver of legopt; name its declaration with --solver FILE "
                                          "(docs/reference/external-solvers.md)");
}

Method ReadMethod(const Listing& row, std::int64_t job_id, const SolverRegistry& registry) {
  const std::string source = "job " + std::to_string(job_id);
  const nlohmann::json options = ParseJson(row.Text(0, "options_json"), source + ", options_json");
  RequireSolver(options, source, registry);
  Method method = Method::FromCanonical(options, source, registry);
  if (const std::string hash = method.Hash(); hash != row.Text(0, "method_hash")) {
    throw ClientError(ExitCode::kUsage, source + ": method '" + row.Text(0, "method") + "' is stored with hash " +
                                            row.Text(0, "method_hash") + ", and this build gives its options hash " +
                                            hash + "; replay it with the build that made it");
  }
  return method;
}

void RequireRepeatable(const Listing& row, std::int64_t job_id) {
  const std::string job = "job " + std::to_string(job_id);
  if (row.At(0, "solver_status").is_null()) {
    throw ClientError(ExitCode::kUsage, job + " has no result (" + row.Text(0, "state") + "), so that there is " +
                                            "nothing to compare with; 'legopt show " + std::to_string(job_id) +
                                            " --logs' shows why");
  }
  const auto status = row.EnumAt<SolveStatus>(0, "solver_status");
  if (IsRepeatable(status)) return;
  throw ClientError(ExitCode::kUsage, job + " ended by " + std::string(ToString(status)) +
                                          ": its bits follow from when it was stopped, and cannot be repeated");
}

}  // namespace

StoredJob ReadStoredJob(ResultSource& source, std::int64_t job_id, const SolverRegistry& registry) {
  const Listing row = source.Query(db::Sql(db::Query::kStoredJob, {{"job_id", job_id}}));
  if (row.rows.empty()) {
    throw ClientError(ExitCode::kUsage,
                      "there is no job " + std::to_string(job_id) + "; 'legopt list" + source.flags() + "' lists them");
  }
  RequireRepeatable(row, job_id);
  const auto integer = [&](const char* column) { return row.At(0, column).get<std::int64_t>(); };
  StoredJob stored;
  stored.job_id = job_id;
  stored.experiment_id = integer("experiment_id");
  stored.job.task = row.EnumAt<Task>(0, "task");
  stored.job.initialization = row.EnumAt<Initialization>(0, "initialization");
  stored.job.problem_id = static_cast<int>(integer("problem_id"));
  stored.job.repetition = static_cast<int>(integer("repetition"));
  stored.job.experiment_seed = static_cast<std::uint64_t>(integer("seed"));
  stored.job.method = ReadMethod(row, job_id, registry);
  stored.job.method.name = row.Text(0, "method");
  stored.job.effort_limit = OptionalAt<std::int64_t>(row, "effort_limit").value_or(0);
  stored.job.wall_limit_s = row.At(0, "wall_limit_s").get<double>();
  stored.dataset_name = row.Text(0, "dataset");
  stored.dataset_hash = row.Text(0, "dataset_hash");
  stored.build_id = row.Text(0, "build_id");
  stored.status = row.EnumAt<SolveStatus>(0, "solver_status");
  stored.literal = row.EnumAt<Verdict>(0, "verdict_literal");
  stored.strict = row.EnumAt<Verdict>(0, "verdict_strict");
  if (!row.At(0, "verdict_solid").is_null()) stored.solid = row.EnumAt<Verdict>(0, "verdict_solid");
  if (!row.At(0, "verdict_physical").is_null()) stored.physical = row.EnumAt<Verdict>(0, "verdict_physical");
  stored.iterations = integer("iterations");
  stored.restarts = integer("restarts");
  stored.starts = OptionalAt<std::int64_t>(row, "starts");
  stored.term_evaluations = OptionalAt<std::int64_t>(row, "term_evaluations");
  stored.collision_queries = OptionalAt<std::int64_t>(row, "collision_queries");
  stored.work_ns = OptionalAt<std::int64_t>(row, "work_ns");
  stored.margin_relaxed = OptionalAt<double>(row, "margin_relaxed");
  stored.solver_cost = OptionalAt<double>(row, "solver_cost");
  stored.solver_violation = OptionalAt<double>(row, "solver_violation");
  stored.cost = OptionalAt<double>(row, "cost");
  stored.trace = TraceRecords(row, job_id);
  stored.waypoints = ReadWaypointsOf(source, job_id);
  stored.unsolved = ReadUnsolvedOf(source, job_id).waypoints;
  return stored;
}

std::vector<std::int64_t> DrawJobs(ResultSource& source, std::int64_t experiment_id,
                                   const std::vector<std::int64_t>& cell_ids, int count, std::uint64_t seed) {
  const Listing rows = source.Query(
      db::Sql(db::Query::kRepeatableResults,
              {{"experiment_id", experiment_id}, {"statuses", RepeatableStatuses()}, {"cell_ids", cell_ids}}));
  std::map<std::int64_t, std::vector<std::int64_t>> by_cell;
  for (std::size_t i = 0; i < rows.rows.size(); ++i) {
    by_cell[rows.At(i, "cell_id").get<std::int64_t>()].push_back(rows.At(i, "job_id").get<std::int64_t>());
  }
  std::mt19937_64 generator(seed);
  std::vector<std::vector<std::int64_t>> cells;
  for (auto& [cell, jobs] : by_cell) {
    std::shuffle(jobs.begin(), jobs.end(), generator);
    cells.push_back(std::move(jobs));
  }
  std::shuffle(cells.begin(), cells.end(), generator);
  std::vector<std::int64_t> drawn;
  for (std::size_t turn = 0; std::any_of(cells.begin(), cells.end(), [&](const auto& c) { return turn < c.size(); });
       ++turn) {
    for (const auto& jobs : cells) {
      if (turn < jobs.size() && std::ssize(drawn) < count) drawn.push_back(jobs[turn]);
    }
  }
  std::sort(drawn.begin(), drawn.end());
  return drawn;
}

std::string Described(const StoredJob& stored) {
  const Job& job = stored.job;
  return job.method.name + ", " + std::string(ToString(job.task)) + " " + std::to_string(job.problem_id) + " from " +
         std::string(ToString(job.initialization)) + ", repetition " + std::to_string(job.repetition) + ", seed " +
         std::to_string(job.experiment_seed);
}

}  // namespace legopt::client

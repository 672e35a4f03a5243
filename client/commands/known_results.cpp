#include "client/commands/known_results.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "legopt/input/json.h"
#include "legopt/types/job.h"

namespace legopt::client {
namespace {

// Returns the limit of a task; a spec has one for all tasks, or one for each.
const nlohmann::json& LimitOf(const nlohmann::json& limit, const std::string& task) {
  return limit.is_object() ? limit.at(task) : limit;
}

// Returns the SQL condition for reusable results of the task.
std::string TaskCondition(const nlohmann::json& spec, const std::string& task) {
  constexpr double kMicrosecondsPerSecond = 1e6;
  const nlohmann::json& limits = spec.at("limits");
  const double wall_s = LimitOf(limits.at("wall_time_s"), task).get<double>();
  const auto effort = limits.find("effort_limit");
  return "(task = " + SqlText(task) +
         " AND wall_us <= " + std::to_string(std::llround(kMicrosecondsPerSecond * wall_s)) + " AND effort_limit IS " +
         (effort == limits.end() ? "NULL" : Dump(LimitOf(*effort, task))) + ")";
}

std::string Joined(const std::vector<std::string>& parts, const char* between) {
  std::string text;
  for (const std::string& part : parts) text += (text.empty() ? "" : between) + part;
  return text;
}

std::string Sql(const nlohmann::json& spec) {
  constexpr double kBytesPerMb = 1 << 20;
  std::vector<std::string> hashes, starts, tasks;
  for (const auto& method : spec.at("methods")) hashes.push_back(SqlText(method.at("hash").get<std::string>()));
  for (const auto& start : spec.at("initializations")) starts.push_back(SqlText(start.get<std::string>()));
  for (const auto& task : spec.at("tasks")) tasks.push_back(TaskCondition(spec, task.at("task").get<std::string>()));
  const double memory_bytes = kBytesPerMb * spec.at("limits").at("memory_mb").get<double>();
  return "SELECT DISTINCT build_id, method_hash, task, initialization, problem_id, repetition FROM reusable_results "
         "WHERE method_hash IN (" +
         Joined(hashes, ", ") + ") AND dataset_hash = " + SqlText(spec.at("dataset").at("hash").get<std::string>()) +
         " AND seed = " + Dump(spec.at("seed")) + " AND repetition < " + Dump(spec.at("repetitions")) +
         " AND peak_memory_bytes <= " + std::to_string(std::llround(memory_bytes)) + " AND initialization IN (" +
         Joined(starts, ", ") + ") AND (" + Joined(tasks, " OR ") + ")";
}

std::map<std::string, std::set<std::int64_t>> ProblemsOfTasks(const nlohmann::json& spec) {
  std::map<std::string, std::set<std::int64_t>> problems;
  for (const auto& task : spec.at("tasks")) {
    problems[task.at("task").get<std::string>()] = task.at("problems").get<std::set<std::int64_t>>();
  }
  return problems;
}

// Rows with the same options under several names have separate jobs.
std::map<std::string, std::int64_t> RowsOfMethods(const nlohmann::json& spec) {
  std::map<std::string, std::int64_t> rows;
  for (const auto& method : spec.at("methods")) ++rows[method.at("hash").get<std::string>()];
  return rows;
}

void ReadKnownJobs(const nlohmann::json& spec, ResultSource& source, KnownResults* known) {
  const Listing results = source.Query(Sql(spec), ResultSource::kAllRows);
  known->truncated = results.truncated;
  const auto problems = ProblemsOfTasks(spec);
  auto methods = RowsOfMethods(spec);
  std::set<std::tuple<std::string, std::string, std::string, std::int64_t, std::int64_t>> jobs;
  std::map<std::string, std::int64_t> builds;
  for (std::size_t i = 0; i < results.rows.size(); ++i) {
    const std::string method = results.Text(i, "method_hash"), task = results.Text(i, "task");
    const auto problem = results.At(i, "problem_id").get<std::int64_t>();
    if (!problems.at(task).contains(problem)) continue;
    builds[results.Text(i, "build_id")] += methods[method];
    const bool is_new = jobs.emplace(method, task, results.Text(i, "initialization"), problem,
                                     results.At(i, "repetition").get<std::int64_t>())
                            .second;
    known->jobs += is_new ? methods[method] : 0;
  }
  for (const auto& [build, count] : builds) known->builds.push_back({build, count});
  std::stable_sort(known->builds.begin(), known->builds.end(),
                   [](const auto& a, const auto& b) { return a.jobs > b.jobs; });
}

}  // namespace

KnownResults FindKnownResults(const Submission& submission, ResultSource* source) {
  KnownResults known;
  known.again = submission.spec.value("again", false);
  known.any_build = submission.spec.value("builds", "") == ToString(BuildPolicy::kAny);
  if (source == nullptr || known.again) return known;
  const Listing same =
      source->Query("SELECT experiment_id FROM experiments WHERE submission_id = " + SqlText(submission.id));
  if (!same.rows.empty()) known.experiment = same.At(0, "experiment_id").get<std::int64_t>();
  ReadKnownJobs(submission.spec, *source, &known);
  return known;
}

std::string KnownResultsText(const KnownResults& known, std::int64_t num_jobs) {
  if (known.again) return "nothing is reused, all jobs are solved again";
  if (known.experiment) {
    return "this experiment was submitted before, as " + std::to_string(*known.experiment) + ": nothing would be begun";
  }
  const std::string of = " of " + std::to_string(num_jobs) + " jobs have a finished result";
  if (known.jobs == 0) return "none" + of + " that they could take over";
  const std::string least = known.truncated ? "at least " : "";
  if (known.any_build) return least + std::to_string(known.jobs) + of + " and take it over";
  std::string text =
      least + std::to_string(known.builds.front().jobs) + of + " of build " + known.builds.front().build_id;
  for (std::size_t i = 1; i < known.builds.size(); ++i) {
    text += ", " + std::to_string(known.builds[i].jobs) + " of build " + known.builds[i].build_id;
  }
  return text + "; those of the build that starts the first job are reused";
}

nlohmann::ordered_json KnownResultsJson(const KnownResults& known) {
  auto builds = nlohmann::ordered_json::array();
  for (const auto& build : known.builds) builds.push_back({{"build_id", build.build_id}, {"jobs", build.jobs}});
  return {{"experiment", known.experiment ? nlohmann::ordered_json(*known.experiment) : nlohmann::ordered_json()},
          {"again", known.again},
          {"jobs", known.jobs},
          {"any_build", known.any_build},
          {"truncated", known.truncated},
          {"builds", std::move(builds)}};
}

}  // namespace legopt::client

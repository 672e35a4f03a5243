#include "client/commands/known_results.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "db/named_queries.h"
#include "legopt/input/json.h"
#include "legopt/types/job.h"

namespace legopt::client {
namespace {

// Returns the limit of a task; a spec has one for all tasks, or one for each.
const nlohmann::json& LimitOf(const nlohmann::json& limit, const std::string& task) {
  return limit.is_object() ? limit.at(task) : limit;
}

// Returns the reusable results of the task.
Listing ReadReusable(const nlohmann::json& spec, const std::string& task, ResultSource& source) {
  constexpr double kMicrosecondsPerSecond = 1e6, kBytesPerMb = 1 << 20;
  const nlohmann::json& limits = spec.at("limits");
  std::vector<std::string> hashes;
  for (const auto& method : spec.at("methods")) hashes.push_back(method.at("hash").get<std::string>());
  const auto effort = limits.find("effort_limit");
  const auto effort_limit =
      effort == limits.end() ? std::nullopt : std::optional(LimitOf(*effort, task).get<std::int64_t>());
  const double wall_s = LimitOf(limits.at("wall_time_s"), task).get<double>();
  const double memory_bytes = kBytesPerMb * limits.at("memory_mb").get<double>();
  return source.Query(db::Sql(db::Query::kReusableJobs,
                              {{"method_hashes", hashes},
                               {"dataset_hash", spec.at("dataset").at("hash").get<std::string>()},
                               {"seed", spec.at("seed").get<std::int64_t>()},
                               {"repetitions", spec.at("repetitions").get<std::int64_t>()},
                               {"memory_bytes", std::llround(memory_bytes)},
                               {"initializations", spec.at("initializations").get<std::vector<std::string>>()},
                               {"task", task},
                               {"wall_us", std::llround(kMicrosecondsPerSecond * wall_s)},
                               {"effort_limit", effort_limit}}),
                      ResultSource::kAllRows);
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
  auto methods = RowsOfMethods(spec);
  std::map<std::string, std::int64_t> builds;
  for (const auto& [task, problems] : ProblemsOfTasks(spec)) {
    const Listing results = ReadReusable(spec, task, source);
    known->truncated = known->truncated || results.truncated;
    std::set<std::tuple<std::string, std::string, std::int64_t, std::int64_t>> jobs;
    for (std::size_t i = 0; i < results.rows.size(); ++i) {
      const std::string method = results.Text(i, "method_hash");
      const auto problem = results.At(i, "problem_id").get<std::int64_t>();
      if (!problems.contains(problem)) continue;
      builds[results.Text(i, "build_id")] += methods[method];
      const bool is_new = jobs.emplace(method, results.Text(i, "initialization"), problem,
                                       results.At(i, "repetition").get<std::int64_t>())
                              .second;
      known->jobs += is_new ? methods[method] : 0;
    }
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
  const Listing same = source->Query(db::Sql(db::Query::kExperimentOfSubmission, {{"submission_id", submission.id}}));
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

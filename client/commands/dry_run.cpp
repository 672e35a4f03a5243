#include "client/commands/dry_run.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iostream>
#include <map>
#include <set>
#include <tuple>

#include "app/printable.h"
#include "client/report/escaped_text.h"
#include "client/report/progress.h"
#include "client/suite/experiment_spec.h"
#include "db/named_queries.h"
#include "legopt/input/json.h"
#include "legopt/types/job.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

struct Mean {
  double cpu_s = 0.0;
  double results = 0.0;

  void Add(double mean_cpu_s, double count) {
    cpu_s += (mean_cpu_s - cpu_s) * count / (results + count);
    results += count;
  }
};

// Method hash, task, whether on the dataset of the spec.
using CostKey = std::tuple<std::string, Task, bool>;

std::map<CostKey, Mean> ReadMeans(const nlohmann::json& spec, ResultSource& source) {
  std::vector<std::string> hashes;
  for (const auto& method : spec.at("methods")) hashes.push_back(method.at("hash").get<std::string>());
  const Listing rows = source.Query(db::Sql(db::Query::kMeanCpuTimes, {{"method_hashes", hashes}}));
  std::map<CostKey, Mean> means;
  const auto dataset = spec.at("dataset").at("hash").get<std::string>();
  for (std::size_t i = 0; i < rows.rows.size(); ++i) {
    const CostKey key{rows.Text(i, "method"), rows.EnumAt<Task>(i, "task"), rows.Text(i, "dataset") == dataset};
    means[key].Add(rows.At(i, "cpu_s").get<double>(), rows.At(i, "results").get<double>());
  }
  return means;
}

}  // namespace

std::vector<KnownCost> FindKnownCosts(const nlohmann::json& spec, ResultSource* source) {
  const std::map<CostKey, Mean> means = source == nullptr ? std::map<CostKey, Mean>() : ReadMeans(spec, *source);
  const auto times =
      static_cast<std::int64_t>(spec.at("initializations").size()) * spec.at("repetitions").get<std::int64_t>();
  std::vector<KnownCost> costs;
  for (const auto& method : spec.at("methods")) {
    for (const auto& task : spec.at("tasks")) {
      KnownCost cost;
      cost.method_hash = method.at("hash").get<std::string>();
      cost.task = ParseEnum<Task>(task.at("task").get<std::string>()).value();
      cost.jobs = static_cast<std::int64_t>(task.at("problems").size()) * times;
      for (const bool same : {true, false}) {
        const auto found = means.find({cost.method_hash, cost.task, same});
        if (found == means.end()) continue;
        cost.job_cpu_s = found->second.cpu_s;
        cost.same_dataset = same;
        break;
      }
      costs.push_back(std::move(cost));
    }
  }
  return costs;
}

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

namespace {

using app::Printable;

// Returns the total time of all jobs if each uses its time limit.
Seconds LongestSolving(const nlohmann::json& spec) {
  const auto& limits = spec.at("limits").at("wall_time_s");
  const std::int64_t jobs = CountJobs(spec);
  std::size_t problems = 0;
  double problem_s = 0;
  for (const auto& task : spec.at("tasks")) {
    const double limit_s = (limits.is_object() ? limits.at(task.at("task").get<std::string>()) : limits).get<double>();
    problems += task.at("problems").size();
    problem_s += limit_s * static_cast<double>(task.at("problems").size());
  }
  return Seconds(problem_s * static_cast<double>(jobs) / static_cast<double>(problems));
}

// Returns e.g. "2.3 s", "4:10".
std::string CpuTime(double seconds) {
  constexpr double kMinute = 60.0;
  if (seconds >= kMinute) return FormatDuration(Seconds(seconds));
  return FormatGeneral(seconds, 2) + " s";
}

// Returns e.g. "posture 100 jobs, about 21 s of CPU time (on other datasets)".
std::string CostText(const KnownCost& cost) {
  std::string text =
      std::string(ToString(cost.task)) + " " + std::to_string(cost.jobs) + (cost.jobs == 1 ? " job, " : " jobs, ");
  if (!cost.job_cpu_s) return text + "CPU time unknown";
  text += "about " + CpuTime(*cost.job_cpu_s * static_cast<double>(cost.jobs)) + " of CPU time";
  return text + (cost.same_dataset ? "" : " (as on other datasets)");
}

void PrintMethods(const nlohmann::json& spec, const std::vector<KnownCost>& costs) {
  auto cost = costs.begin();
  for (const auto& method : spec.at("methods")) {
    std::cout << "  " << Printable(method.at("name").get<std::string>()) << ", " << method.at("multi_starts")
              << " multi-starts, sample size " << method.at("sample_size") << " %, "
              << method.at("options").at("options").value("collision", "solid") << " obstacles";
    for (std::size_t i = 0; i < spec.at("tasks").size(); ++i, ++cost)
      std::cout << (i == 0 ? ": " : "; ") << CostText(*cost);
    std::cout << "\n";
  }
}

struct KnownTotal {
  std::int64_t jobs = 0;  // number of jobs with known cost
  double cpu_s = 0.0;
};

KnownTotal TotalOf(const std::vector<KnownCost>& costs) {
  KnownTotal total;
  for (const KnownCost& cost : costs) {
    if (!cost.job_cpu_s) continue;
    total.jobs += cost.jobs;
    total.cpu_s += *cost.job_cpu_s * static_cast<double>(cost.jobs);
  }
  return total;
}

}  // namespace

void PrintDryRun(const Submission& submission, ResultSource* known, int slots, const std::string& outlook) {
  const auto& spec = submission.spec;
  std::cout << "experiment '" << Printable(spec.at("name").get<std::string>()) << "' on dataset "
            << Printable(spec.at("dataset").at("name").get<std::string>()) << " ("
            << spec.at("dataset").at("hash").get<std::string>().substr(0, 12) << "), seed " << spec.at("seed") << "\n"
            << DescribeJobs(spec) << "\n";
  const std::vector<KnownCost> costs = FindKnownCosts(spec, known);
  PrintMethods(spec, costs);
  for (const auto& loss : submission.left_out) std::cout << "left out: " << loss << "\n";
  std::cout << KnownResultsText(FindKnownResults(submission, known), submission.num_jobs) << "\n";
  const KnownTotal total = TotalOf(costs);
  std::cout << "expected CPU time: "
            << (total.jobs == 0 ? std::string("unknown, there are no results of these methods yet")
                                : "about " + CpuTime(total.cpu_s) + ", known of " + std::to_string(total.jobs) +
                                      " of " + std::to_string(submission.num_jobs) + " jobs")
            << "\n";
  const Seconds longest = LongestSolving(spec);
  std::cout << "at most " << FormatDuration(slots > 0 ? longest / slots : longest) << " of solving by the time limit, "
            << (slots > 0 ? "with " + std::to_string(slots) + (slots == 1 ? " worker" : " workers")
                          : std::string("divided by the slots of the pool"))
            << "\n"
            << Printable(outlook) << " (--dry-run)\n";
}

void PrintDryRunJson(const Submission& submission, ResultSource* known) {
  auto estimate = nlohmann::ordered_json::array();
  for (const KnownCost& cost : FindKnownCosts(submission.spec, known)) {
    estimate.push_back({{"method_hash", cost.method_hash},
                        {"task", ToString(cost.task)},
                        {"jobs", cost.jobs},
                        {"job_cpu_s", cost.job_cpu_s ? nlohmann::ordered_json(*cost.job_cpu_s) : nullptr},
                        {"same_dataset", cost.same_dataset}});
  }
  std::cout << JsonText(nlohmann::ordered_json{{"submission_id", submission.id},
                                               {"jobs", submission.num_jobs},
                                               {"left_out", submission.left_out},
                                               {"estimate", estimate},
                                               {"known_results", KnownResultsJson(FindKnownResults(submission, known))},
                                               {"spec", submission.spec}})
            << "\n";
}

}  // namespace legopt::client

#include "client/commands/dry_run.h"

#include <cstdint>
#include <iostream>

#include "app/printable.h"
#include "client/commands/known_costs.h"
#include "client/commands/known_results.h"
#include "client/report/json_text.h"
#include "client/report/progress.h"
#include "client/suite/experiment_spec.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
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

#include "client/commands/dry_run.h"

#include <cstdint>
#include <iostream>

#include "client/report/json_text.h"
#include "client/report/progress.h"
#include "client/suite/experiment_spec.h"
#include "programs/printable.h"

namespace legopt::client {
namespace {

using programs::Printable;

// Of all jobs, if each needs all the time that its task may take.
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

void PrintMethods(const nlohmann::json& spec) {
  for (const auto& method : spec.at("methods")) {
    std::cout << "  " << Printable(method.at("name").get<std::string>()) << ", " << method.at("multi_starts")
              << " multi-starts, sample size " << method.at("sample_size") << " %, "
              << method.at("options").at("options").value("collision", "solid") << " obstacles\n";
  }
}

}  // namespace

void PrintDryRun(const Submission& submission, int slots, const std::string& outlook) {
  const auto& spec = submission.spec;
  std::cout << "experiment '" << Printable(spec.at("name").get<std::string>()) << "' on dataset "
            << Printable(spec.at("dataset").at("name").get<std::string>()) << " ("
            << spec.at("dataset").at("hash").get<std::string>().substr(0, 12) << "), seed " << spec.at("seed") << "\n"
            << DescribeJobs(spec) << "\n";
  PrintMethods(spec);
  for (const auto& loss : submission.left_out) std::cout << "left out: " << loss << "\n";
  const Seconds longest = LongestSolving(spec);
  std::cout << "at most " << FormatDuration(slots > 0 ? longest / slots : longest) << " of solving by the time limit, "
            << (slots > 0 ? "with " + std::to_string(slots) + (slots == 1 ? " worker" : " workers")
                          : std::string("divided by the slots of the pool"))
            << "\n"
            << Printable(outlook) << " (--dry-run)\n";
}

void PrintDryRunJson(const Submission& submission) {
  std::cout << JsonText(nlohmann::ordered_json{{"submission_id", submission.id},
                                               {"jobs", submission.num_jobs},
                                               {"left_out", submission.left_out},
                                               {"spec", submission.spec}})
            << "\n";
}

}  // namespace legopt::client

#include "client/submission.h"

#include <iostream>

#include "client/chosen_files.h"
#include "client/client_error.h"
#include "client/experiment_spec.h"
#include "legopt/import/plausibility.h"
#include "legopt/problem/dataset.h"

namespace legopt::client {
namespace {

constexpr std::int64_t kMaxJobs = 1'000'000;  // of one experiment, by the protocol

std::string Plural(std::int64_t count, const std::string& word) {
  return std::to_string(count) + " " + word + (count == 1 ? "" : "s");
}

/// What is hardly meant, before hours are spent on it.
void WarnAbout(const Dataset& dataset) {
  for (const DatasetFinding& finding : CheckPlausibility(dataset)) {
    std::cerr << "legopt: warning: " << dataset.folder().string() << ": " << finding.field
              << (finding.value.empty() ? "" : " (" + finding.value + ")") << ": " << finding.message << "; "
              << finding.fix << "\n";
  }
}

}  // namespace

Submission PrepareSubmission(const SuiteOptions& options) {
  Suite suite = ReadSuite(FindSuite(options.suite));
  ApplyFilter(options.filter, &suite);
  Submission submission;
  submission.dataset_folder =
      std::filesystem::absolute(ChooseDatasetFolder(options.dataset, &suite)).lexically_normal();
  const auto dataset = Dataset::Load(submission.dataset_folder);
  WarnAbout(*dataset);
  submission.spec = BuildSpec(suite, FactsOf(*dataset));
  if (const std::string name = SubmitterName(); !name.empty()) submission.spec["submitter"] = name;
  submission.num_jobs = CountJobs(submission.spec);
  if (submission.num_jobs > kMaxJobs) {
    throw ClientError(ExitCode::kUsage, suite.file + ": " + std::to_string(submission.num_jobs) +
                                            " jobs are more than one experiment may have (1000000); split it");
  }
  submission.id = options.fresh ? RandomSubmissionId() : ContentSubmissionId(submission.spec);
  return submission;
}

std::string DescribeJobs(const nlohmann::json& spec) {
  std::string problems;
  for (const auto& task : spec.at("tasks")) {
    if (!problems.empty()) problems += " + ";
    problems +=
        Plural(static_cast<std::int64_t>(task.at("problems").size()), task.at("task").get<std::string>() + " problem");
  }
  if (spec.at("tasks").size() > 1) problems = "(" + problems + ")";
  const auto count = [&spec](const char* key) { return static_cast<std::int64_t>(spec.at(key).size()); };
  return Plural(CountJobs(spec), "job") + ": " + Plural(count("methods"), "method") + " x " +
         Plural(count("initializations"), "initialization") + " x " + problems + " x " +
         Plural(spec.at("repetitions").get<std::int64_t>(), "repetition");
}

}  // namespace legopt::client

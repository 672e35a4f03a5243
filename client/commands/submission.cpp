#include "client/commands/submission.h"

#include <iostream>

#include "app/isolated_call.h"
#include "app/printable.h"
#include "bus/spec_limits.h"
#include "bus/text.h"
#include "client/client_error.h"
#include "client/report/submitted_datasets.h"
#include "client/suite/chosen_files.h"
#include "client/suite/experiment_spec.h"
#include "client/suite/input_files.h"
#include "legopt/dataset/dataset.h"
#include "legopt/dataset/dataset_file.h"
#include "legopt/files/written_file.h"
#include "legopt/import/plausibility.h"
#include "legopt/input/json.h"
#include "legopt/input/name.h"
#include "legopt/types/input_error.h"
#include "worker/external/declaration.h"
#include "worker/external/external_solvers.h"

namespace legopt::client {
namespace {

namespace limits = bus::spec_limits;

std::string Plural(std::int64_t count, const std::string& word) {
  return std::to_string(count) + " " + word + (count == 1 ? "" : "s");
}

/// Warns about implausible values before hours are spent on them.
void WarnAbout(const Dataset& dataset) {
  for (const DatasetDiagnostic& finding : CheckPlausibility(dataset)) {
    const std::string text = dataset.folder().string() + ": " + finding.field +
                             (finding.value.empty() ? "" : " (" + finding.value + ")") + ": " + finding.message + "; " +
                             finding.fix;
    std::cerr << "legopt: warning: " << app::Printable(text) << "\n";
  }
}

// A suite checks its own names; a name may also come from a file or folder.
void CheckName(const std::string& name, const std::string& file, const std::string& fix) {
  if (const auto fault = DiagnoseName(name)) throw InputError({file, "name", name, fault->message, fix});
  if (name.size() <= limits::kMostNameBytes) return;
  throw InputError({file, "name", name,
                    "must be UTF-8 of 1 to " + std::to_string(limits::kMostNameBytes) + " bytes, it has " +
                        std::to_string(name.size()),
                    fix});
}

void CheckSize(const Suite& suite, const Submission& submission) {
  if (submission.num_jobs > limits::kMaxJobs) {
    throw ClientError(ExitCode::kUsage, suite.file + ": " + std::to_string(submission.num_jobs) +
                                            " jobs are more than one experiment may have (" +
                                            std::to_string(limits::kMaxJobs) + "); split it");
  }
  const std::size_t bytes = Dump(submission.spec).size();
  if (bytes > limits::kMostBytes) {
    throw ClientError(ExitCode::kUsage, suite.file + ": written out, the experiment has " + std::to_string(bytes) +
                                            " bytes, more than can be sent (" + std::to_string(limits::kMostBytes) +
                                            "); split it");
  }
}

// Reports how the dataset's path is resolved for a suite from a pipe, which has no folder.
void ReportPlaceOfDataset(const Suite& suite) {
  if (!suite.dataset || !files::IsStream(suite.file)) return;
  std::cerr << "legopt: " << app::Printable(suite.file) << ": the dataset is relative to the working directory: "
            << app::Printable(std::filesystem::absolute(*suite.dataset).lexically_normal().string()) << "\n";
}

}  // namespace

Submission PrepareSubmission(const SuiteOptions& options) {
  std::vector<std::filesystem::path> solvers = options.solvers;
  for (std::filesystem::path& file : solvers) file = InputFile(file.string());
  Suite suite = ReadSuite(FindSuite(options.suite), external::RegistryWith(external::ReadDeclarations(solvers)));
  ReportPlaceOfDataset(suite);
  ApplyFilter(options.filter, &suite);
  Submission submission;
  submission.dataset_folder =
      std::filesystem::absolute(ChooseDatasetFolder(options.dataset, &suite)).lexically_normal();
  const auto dataset = Dataset::Load(submission.dataset_folder, CallIsolated);
  WarnAbout(*dataset);
  const DatasetFacts facts = FactsOf(*dataset);
  CheckName(suite.name, suite.file, "give the suite another 'name'");
  CheckName(facts.name, (submission.dataset_folder / kDatasetFileName).string(),
            "choose another, then 'legopt dataset hash'");
  submission.spec = BuildSpec(suite, facts, &submission.left_out);
  if (const std::string name = SubmitterName(); !name.empty()) submission.spec["submitter"] = name;
  if (options.fresh) submission.spec["again"] = true;
  const bool task_lost = submission.spec.at("tasks").size() < suite.tasks.size();
  submission.surprising = !submission.left_out.empty() && (task_lost || !options.filter.problems.empty());
  submission.num_jobs = CountJobs(submission.spec);
  CheckSize(suite, submission);
  submission.id = options.fresh ? RandomSubmissionId() : ContentSubmissionId(submission.spec);
  return submission;
}

void RecordDataset(const Submission& submission) {
  RecordDatasetFolder(submission.spec.at("dataset").at("hash").get<std::string>(), submission.dataset_folder);
}

void WarnAboutOmittedProblems(const Submission& submission) {
  if (!submission.surprising) return;
  for (const auto& loss : submission.left_out) {
    std::cerr << "legopt: warning: " << loss << "; --max-stances takes them in\n";
  }
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

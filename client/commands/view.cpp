#include <spawn.h>
#include <sys/wait.h>

#include <array>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <memory>

#include "app/checks.h"
#include "app/command_line.h"
#include "app/isolated_call.h"
#include "app/printable.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/page/page_view.h"
#include "client/report/job_choice.h"
#include "client/report/replaced_file.h"
#include "client/report/result_dataset.h"
#include "client/suite/chosen_files.h"
#include "db/named_queries.h"
#include "legopt/files/file_error.h"
#include "legopt/files/written_file.h"

extern char** environ;

namespace legopt::client {
namespace {

struct ViewOptions {
  std::optional<std::int64_t> job, ghost;
  JobChoice choice;  ///< its problem is also that of a page without a solution
  std::optional<std::string> dataset, out;
  bool open = false;
  SourceOptions source;
  app::BuildFacts build;
};

std::string DefaultStem(const ViewOptions& options) {
  return options.job ? "job-" + std::to_string(*options.job)
                     : "problem-" + std::to_string(options.choice.problem.value_or(0));
}

bool HasContent(const std::string& file, const std::string& text) {
  std::ifstream stream(file, std::ios::binary);
  return stream && std::string{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()} == text;
}

// Writes a file whose name nothing has, or leaves one that holds this text: "STEM.html", "STEM-2.html", ... Returns its
// name.
std::string WriteUnderFreeName(const std::string& stem, const std::string& text) {
  for (int i = 1;; ++i) {
    const std::string name = stem + (i == 1 ? "" : "-" + std::to_string(i)) + ".html";
    if (HasContent(name, text)) return name;
    try {
      files::CreateFile(name, text);
      return name;
    } catch (const files::FileError& error) {
      if (error.error() != EEXIST)
        throw ClientError(error.shortage() ? ExitCode::kMachine : ExitCode::kUsage, error.what());
    }
  }
}

// Opens the file in the desktop's default browser.
void Open(const std::string& file) {
  std::string program = "xdg-open", argument = std::filesystem::absolute(file).string();
  const std::array<char*, 3> arguments = {program.data(), argument.data(), nullptr};
  pid_t child = 0;
  int status = 0;
  const bool started = posix_spawnp(&child, program.c_str(), nullptr, nullptr, arguments.data(), environ) == 0;
  if (started && waitpid(child, &status, 0) == child && status == 0) return;
  throw ClientError(ExitCode::kMachine, "xdg-open could not show " + file + "; open it in a browser");
}

// Returns the dataset of the job's results if no folder is given.
std::shared_ptr<const Dataset> DatasetToShow(const ViewOptions& options) {
  if (options.job && !options.dataset) {
    const auto source = OpenResults(options.source);
    const Listing found = source->Query(db::Sql(db::Query::kDatasetOfJob, {{"job_id", *options.job}}));
    if (!found.rows.empty()) {
      if (auto dataset = FindResultDataset(*source, found.Text(0, "hash"))) return dataset;
    }
  }
  return Dataset::Load(ChooseDatasetFolder(options.dataset, nullptr), CallIsolated);
}

// Returns whether options choose a job of an experiment. --problem and --tasks alone choose a problem of the dataset.
bool ChoosesJob(const JobChoice& choice) {
  ResultFilter of_jobs = choice.filter;
  of_jobs.tasks.clear();
  return choice.experiment || !of_jobs.empty();
}

// Returns the task of a problem without a job.
Task TaskOf(const JobChoice& choice) {
  if (choice.filter.tasks.size() > 1) {
    throw ClientError(ExitCode::kUsage, Describe(choice.filter) + ": a problem has one task");
  }
  return choice.filter.tasks.empty() ? Task::kPosture : *ParseEnum<Task>(choice.filter.tasks.front());
}

// Returns the options with the job that they choose, if any.
ViewOptions WithJob(ViewOptions options) {
  const JobChoice& choice = options.choice;
  if (options.job && (choice.problem || ChoosesJob(choice) || !choice.filter.empty())) {
    throw ClientError(ExitCode::kUsage, "name a job or choose one by options, not both: 'legopt view 12'");
  }
  if (ChoosesJob(choice)) options.job = ChooseJob(*OpenResults(options.source), choice);
  if (!options.job && !choice.problem) {
    throw ClientError(ExitCode::kUsage, "name a job or a problem: 'legopt view 12' or 'legopt view --problem 3'");
  }
  return options;
}

ExitCode View(const ViewOptions& given) {
  const ViewOptions options = WithJob(given);
  ViewRequest request;
  request.source = options.source;
  request.job = options.job;
  request.ghost = options.ghost;
  request.task = options.job ? Task::kPosture : TaskOf(options.choice);
  request.problem = options.choice.problem;
  request.build = options.build;
  request.dataset = DatasetToShow(options);
  const Page page = MakeView(request);
  if (options.out) ReplaceFile(*options.out, page.text);
  const std::string written = options.out ? *options.out : WriteUnderFreeName(DefaultStem(options), page.text);
  std::cerr << app::Printable(written) << " written\n";
  if (options.open) Open(written);
  return ExitCode::kOk;
}

}  // namespace

void AddViewCommand(const app::Command& program, Invocation* invocation) {
  const auto command = program.AddCommand("view", "Write a page that shows a job's solution, or a problem, in 3D");
  const auto options = std::make_shared<ViewOptions>();
  command.AddOption("JOB", options->job, "Job, as 'legopt list' shows it").Check(app::WholeNumber(1));
  command
      .AddOption("--problem", options->choice.problem,
                 "Show a problem of the dataset, without a solution (task: --tasks, default posture), or a job of it")
      .Check(app::WholeNumber(0));
  AddJobChoiceOptions(command, &options->choice);
  command.AddOption("--ghost", options->ghost, "Draw another job of the same problem transparently")
      .Check(app::WholeNumber(1));
  command.AddOption("--out", options->out,
                    "File to write or replace (default: job-JOB.html, or the next free name: job-JOB-2.html)");
  command.AddFlag("--open", options->open, "Open the file in a browser");
  AddDatasetOption(command, &options->dataset);
  AddSourceOptions(command, &options->source);
  command.WhenChosen([=] {
    options->build = invocation->build;
    invocation->body = [options] { return View(*options); };
  });
}

}  // namespace legopt::client

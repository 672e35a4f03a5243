#include <iostream>
#include <memory>

#include "app/checks.h"
#include "app/command_line.h"
#include "app/isolated_call.h"
#include "app/printable.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/report/exported_solutions.h"
#include "client/report/result_dataset.h"
#include "client/suite/chosen_files.h"
#include "legopt/files/written_file.h"

namespace legopt::client {
namespace {

struct ExportOptions {
  std::optional<std::int64_t> experiment;
  std::string out;
  std::optional<std::string> dataset;
  ResultFilter filter;
  SourceOptions source;
};

std::shared_ptr<const Dataset> LoadDatasetOf(ResultSource& source, const ExperimentInfo& experiment,
                                             const ExportOptions& options) {
  if (!options.dataset) {
    if (auto found = FindResultDataset(source, experiment.dataset_hash)) return found;
  }
  const auto folder = ChooseDatasetFolder(options.dataset, nullptr);
  auto dataset = Dataset::Load(folder, CallIsolated);
  if (dataset->content_hash() != experiment.dataset_hash) {
    throw ClientError(ExitCode::kDatasetMismatch, "experiment " + std::to_string(experiment.id) +
                                                      " was made with the dataset '" + experiment.dataset_name +
                                                      "' of hash " + experiment.dataset_hash + ", but " +
                                                      folder.string() + " has hash " + dataset->content_hash() +
                                                      "; name the right folder with --dataset");
  }
  return dataset;
}

constexpr char kStandardOutput[] = "-";

// Returns the file itself for a single task, else one file per task with the task appended to its name.
std::filesystem::path FileFor(const std::string& out, const SolutionFile& file, std::size_t num_files) {
  if (num_files == 1) return out;
  std::filesystem::path path(out);
  const std::string name = path.stem().string() + "-" + std::string(ToString(file.task)) + path.extension().string();
  return path.replace_filename(name);
}

void Write(const std::string& out, const SolutionFile& file, std::size_t num_files) {
  const auto path = FileFor(out, file, num_files);
  if (out == kStandardOutput) {
    std::cout << FormatSolutions(file) << std::flush;
    if (!std::cout) return;  // the caller of the command reports the error, as for every command
  } else {
    WriteSolutions(path, file);
  }
  std::cerr << file.problems.size() << " " << ToString(file.task) << " problems written to "
            << (out == kStandardOutput ? "standard output" : app::Printable(path.string())) << "\n";
}

// Returns e.g. "both tasks, -a and -b".
std::string AllTasks() {
  std::string endings;
  for (const auto& row : kEnumNames<Task>) endings += (endings.empty() ? "-" : " and -") + std::string(row.word);
  return (kNumEnumerators<Task> == 2 ? "both tasks, " : "several tasks, ") + endings;
}

ExitCode Export(const ExportOptions& options) {
  const auto source = OpenResults(options.source);
  const auto experiment = FindExperiment(*source, options.experiment);
  const auto dataset = LoadDatasetOf(*source, experiment, options);
  const auto exported = ReadSolutionsOf(*source, experiment.id, *dataset, options.filter);
  if (exported.num_solutions == 0) {
    throw ClientError(ExitCode::kUsage, "experiment " + std::to_string(experiment.id) +
                                            " has no results that match; 'legopt list " +
                                            std::to_string(experiment.id) + source->flags() + "' shows what there is");
  }
  const bool one_stream = options.out == kStandardOutput || files::IsStream(options.out);
  if (one_stream && exported.files.size() > 1) {
    throw ClientError(ExitCode::kUsage, std::string(exported.files.size() == 2
                                                        ? "the experiment has both tasks, which make two files"
                                                        : "the experiment has several tasks, which make a file each") +
                                            ": choose one with --tasks, or a --out FILE");
  }
  for (const auto& file : exported.files) Write(options.out, file, exported.files.size());
  if (exported.num_missing > 0) {
    std::cerr << "legopt: warning: " << exported.num_missing
              << " jobs have no result (unfinished, dead or cancelled) and are not in the file\n";
  }
  return ExitCode::kOk;
}

}  // namespace

void AddExportCommand(const app::Command& program, Invocation* invocation) {
  const auto command =
      program.AddCommand("export", "Write solutions as LegOpt solution JSON, which 'legopt evaluate' judges");
  const auto options = std::make_shared<ExportOptions>();
  command.AddOption("ID", options->experiment, "Experiment (default: the newest)").Check(app::WholeNumber(1));
  command
      .AddOption("--out", options->out,
                 "File to write, - for standard output; with " + AllTasks() + " are added to its name")
      .Required();
  AddResultFilterOptions(command, &options->filter);
  command.AddOption("--dataset", options->dataset,
                    "Dataset folder, for the problem definitions (default: the embedded garage-easier)");
  AddSourceOptions(command, &options->source);
  command.WhenChosen([=] { invocation->body = [options] { return Export(*options); }; });
}

}  // namespace legopt::client

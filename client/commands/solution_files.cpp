#include <algorithm>
#include <cstdint>
#include <iostream>
#include <map>
#include <memory>

#include "app/command_line.h"
#include "app/folder_cache.h"
#include "app/printable.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/motion_export.h"
#include "client/commands/options.h"
#include "client/report/evaluation_report.h"
#include "client/report/exported_solutions.h"
#include "client/report/push_report.h"
#include "client/report/result_dataset.h"
#include "client/report/result_filter.h"
#include "client/report/timing_report.h"
#include "client/suite/input_files.h"
#include "legopt/files/written_file.h"
#include "legopt/math/parallel.h"

namespace legopt::client {
namespace {

// Returns the solutions of a file in its order. Methods with different names have different ids.
std::vector<FilteredItem> ItemsOf(const SolutionFile& file) {
  std::map<std::string, std::int64_t> ids;
  std::vector<FilteredItem> items;
  for (const SolvedProblem& problem : file.problems) {
    for (const Solution& solution : problem.solutions) {
      MethodIdentity method;
      method.method_id = ids.try_emplace(solution.method, std::ssize(ids)).first->second;
      method.name = solution.method;
      items.push_back({std::move(method), std::string(ToString(file.task)), solution.init_type});
    }
  }
  return items;
}

// Removes the solutions that the filter omits; their problems then count as not solved.
void KeepSolutions(const ResultFilter& filter, const std::string& name, SolutionFile* file) {
  if (filter.empty()) return;
  const std::vector<std::size_t> kept = KeptItems(ItemsOf(*file), filter, name);
  std::size_t position = 0;
  for (SolvedProblem& problem : file->problems) {
    std::erase_if(problem.solutions,
                  [&](const Solution& /*solution*/) { return !std::ranges::binary_search(kept, position++); });
  }
}

struct ExportOptions {
  std::optional<std::int64_t> experiment;
  std::string out;
  std::optional<std::string> dataset;
  ResultFilter filter;
  MotionExport motion;
  SourceOptions source;
};

std::shared_ptr<const Dataset> LoadDatasetOf(ResultSource& source, const ExperimentInfo& experiment,
                                             const ExportOptions& options) {
  if (!options.dataset) {
    if (auto found = FindResultDataset(source, experiment.dataset_hash)) return found;
  }
  const auto folder = ChooseDatasetFolder(options.dataset, nullptr);
  auto dataset = Dataset::Load(folder, GuardedReader());
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

void WriteText(const std::string& out, const std::string& text) {
  if (out == kStandardOutput) {
    std::cout << text << std::flush;
  } else {
    WriteOutputFile(out, text);
    std::cerr << app::Printable(out) << " written\n";
  }
}

ExitCode ExportMotionOfFile(const ExportOptions& options) {
  if (options.experiment) {
    throw ClientError(ExitCode::kUsage, "--file " + *options.motion.file + " and experiment " +
                                            std::to_string(*options.experiment) + ": name only one of them");
  }
  SolutionFile file = ReadSolutions(InputFile(*options.motion.file));
  KeepSolutions(options.filter, *options.motion.file, &file);
  const auto dataset = Dataset::Load(ChooseDatasetFolder(options.dataset, nullptr), GuardedReader());
  WriteText(options.out, ExportedMotion(options.motion, {file}, *dataset, *options.motion.file));
  return ExitCode::kOk;
}

ExitCode Export(const ExportOptions& options) {
  if (options.motion.file) return ExportMotionOfFile(options);
  const auto source = OpenResults(options.source);
  const auto experiment = FindExperiment(*source, options.experiment);
  const auto dataset = LoadDatasetOf(*source, experiment, options);
  const auto exported = ReadSolutionsOf(*source, experiment.id, *dataset, options.filter);
  if (exported.num_solutions == 0) {
    throw ClientError(ExitCode::kUsage, "experiment " + std::to_string(experiment.id) +
                                            " has no results that match; 'legopt list " +
                                            std::to_string(experiment.id) + source->flags() + "' shows what there is");
  }
  if (options.motion.format) {
    WriteText(options.out,
              ExportedMotion(options.motion, exported.files, *dataset, "experiment " + std::to_string(experiment.id)));
    return ExitCode::kOk;
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
  const auto command = program.AddCommand(
      "export", "Write solutions as LegOpt solution JSON, which 'legopt evaluate' judges, or a motion");
  const auto options = std::make_shared<ExportOptions>();
  command.AddOption("ID", options->experiment, "Experiment (default: the newest)").Check(app::WholeNumber(1));
  command
      .AddOption("--out", options->out,
                 "File to write, - for standard output; with " + AllTasks() + " are added to its name")
      .Required();
  AddResultFilterOptions(command, &options->filter);
  AddMotionExportOptions(command, &options->motion);
  command.AddOption("--dataset", options->dataset,
                    "Dataset folder, for the problem definitions (default: the embedded garage-easier)");
  AddSourceOptions(command, &options->source);
  command.SetFooter("Motions in time, their formats and players: docs/how-to/export-motions.md");
  command.WhenChosen([=] { invocation->body = [options] { return Export(*options); }; });
}

namespace {

struct EvaluateOptions {
  std::string file;
  std::optional<std::string> dataset;
  std::optional<Rule> rule;
  Definitions definitions = Definitions::kFile;
  std::optional<DurationRows> durations;
  std::optional<PushRows> pushes;
  bool exhaustive = false;
  ResultFilter filter;
  std::vector<std::string> rows, columns;
  TableFormat format = TableFormat::kText;
  TimeUnit time_unit = kMilliseconds;
  OutputOptions output;
};

[[noreturn]] void RefuseProblemFile(const std::string& file) {
  throw ClientError(ExitCode::kUsage, file + ": no problem has a 'solution'; is it a problem file?");
}

void PrintFigures(const EvaluateOptions& options, const Listing& listing) {
  PrintListing(listing,
               {.format = options.format, .rows = options.rows, .columns = options.columns, .output = options.output});
}

ExitCode PrintDurations(const EvaluateOptions& options, const SolutionFile& file, const Dataset& dataset) {
  const std::vector<TimedSolution> timed = TimeSolutions(file, dataset, NumProcessors());
  if (timed.empty()) RefuseProblemFile(options.file);
  PrintFigures(options, *options.durations == DurationRows::kMotions ? ListingOf(timed) : SummaryOf(timed));
  return ExitCode::kOk;
}

ExitCode PrintPushes(const EvaluateOptions& options, const SolutionFile& file, const Dataset& dataset) {
  const std::vector<PushedSolution> pushed = PushSolutions(file, dataset, NumProcessors());
  if (pushed.empty()) RefuseProblemFile(options.file);
  PrintFigures(options, *options.pushes == PushRows::kProblems ? ListingOf(pushed) : SummaryOf(pushed));
  return ExitCode::kOk;
}

ExitCode Evaluate(const EvaluateOptions& options) {
  SolutionFile file = ReadSolutions(InputFile(options.file));
  KeepSolutions(options.filter, options.file, &file);
  const auto dataset = Dataset::Load(ChooseDatasetFolder(options.dataset, nullptr), GuardedReader());
  if (options.durations) return PrintDurations(options, file, *dataset);
  if (options.pushes) return PrintPushes(options, file, *dataset);
  Judge judge(dataset, options.exhaustive ? Culling::kOff : Culling::kOn);
  const auto report = EvaluateSolutions(file, judge, options.rule.value_or(Rule::kLiteral), options.definitions);
  if (report.rows.empty()) RefuseProblemFile(options.file);
  const std::string text = RenderEvaluation(
      report, options.format, {options.time_unit, LayoutOf(options.output), options.columns}, options.rows);
  Print(options.format == TableFormat::kCsv ? CsvFor(StandardOutput(), text) : text, options.output);
  for (const auto& warning : report.warnings) std::cerr << "legopt: warning: " << app::Printable(warning) << "\n";
  const auto unreadable =
      std::count_if(report.rows.begin(), report.rows.end(), [](const JudgedRow& row) { return row.unreadable; });
  if (unreadable == 0) return ExitCode::kOk;
  throw ClientError(ExitCode::kJobsFailed, options.file + ": " + std::to_string(unreadable) + " of " +
                                               std::to_string(report.rows.size()) +
                                               " solutions have numbers that cannot be read; correct or remove them");
}

}  // namespace

void AddEvaluateCommand(const app::Command& program, Invocation* invocation) {
  const auto command =
      program.AddCommand("evaluate", "Judge a LegOpt solution file: per method successes, mean cost, mean time");
  const auto options = std::make_shared<EvaluateOptions>();
  command.AddOption("FILE", options->file, "LegOpt solution JSON, - for standard input").Required();
  AddDatasetOption(command, &options->dataset);
  command.AddEnum<Definitions>(
      "--definitions", options->definitions,
      "Source of the problem definitions: file (default), as in the original evaluator, or dataset");
  AddRuleOption(command, &options->rule, "literal");
  const auto durations = command.AddEnum<DurationRows>(
      "--durations", options->durations,
      "Print the shortest durations of motions within joint limits and friction, per method or "
      "motion, instead of verdicts");
  command
      .AddEnum<PushRows>("--pushes", options->pushes,
                         "Print success by the physical rule, shares of effort limits and the largest pushes that are "
                         "resisted, within effort limits and by contact forces alone, per method or problem")
      .Excludes(durations);
  command.AddFlag("--exhaustive", options->exhaustive,
                  "Compare all meshes exactly, without culling: slow, same results");
  AddNameFilterOptions(command, &options->filter);
  AddFormatOption(command, &options->format);
  AddRowsOption(command, &options->rows, "methods");
  AddColumnsOption(command, &options->columns);
  AddTimeUnitOption(command, &options->time_unit);
  AddOutputOptions(command, &options->output);
  command.WhenChosen([=] { invocation->body = [options] { return Evaluate(*options); }; });
}

}  // namespace legopt::client

#include <algorithm>
#include <cstdint>
#include <iostream>
#include <map>
#include <memory>

#include "app/checks.h"
#include "app/command_line.h"
#include "app/isolated_call.h"
#include "app/printable.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/report/evaluation_report.h"
#include "client/report/result_filter.h"
#include "client/suite/chosen_files.h"
#include "client/suite/input_files.h"

namespace legopt::client {
namespace {

struct EvaluateOptions {
  std::string file;
  std::optional<std::string> dataset;
  std::optional<Rule> rule;
  Definitions definitions = Definitions::kFile;
  bool exhaustive = false;
  ResultFilter filter;
  std::vector<std::string> rows, columns;
  TableFormat format = TableFormat::kText;
  TimeUnit time_unit = kMilliseconds;
  OutputOptions output;
};

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

ExitCode Evaluate(const EvaluateOptions& options) {
  SolutionFile file = ReadSolutions(InputFile(options.file));
  KeepSolutions(options.filter, options.file, &file);
  Judge judge(Dataset::Load(ChooseDatasetFolder(options.dataset, nullptr), CallIsolated),
              options.exhaustive ? Culling::kOff : Culling::kOn);
  const auto report = EvaluateSolutions(file, judge, options.rule.value_or(Rule::kLiteral), options.definitions);
  if (report.rows.empty()) {
    throw ClientError(ExitCode::kUsage, options.file + ": no problem has a 'solution'; is it a problem file?");
  }
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

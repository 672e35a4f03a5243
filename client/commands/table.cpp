#include <CLI/CLI.hpp>
#include <memory>

#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/report/benchmark_table.h"
#include "client/report/paper_table.h"
#include "client/report/reading.h"
#include "programs/checks.h"
#include "programs/data_folder.h"

namespace legopt::client {
namespace {

struct Options {
  TableSelection selection;
  SourceOptions source;
  TableFormat format = TableFormat::kText;
  TimeUnit time_unit = kMilliseconds;
  OutputOptions output;
  bool interpolation = false;
  bool paper = false;
};

constexpr char kPaperTable[] = "paper-table1.csv";

std::string Render(const Options& options) {
  const auto source = OpenResults(options.source);
  const TableStyle style{options.time_unit, LayoutOf(options.output)};
  if (options.interpolation) {
    return RenderInterpolationTable(ReadInterpolationTable(*source, options.selection), options.format, style.layout);
  }
  BenchmarkTable table = ReadBenchmarkTable(*source, options.selection);
  if (options.paper) AddPaperFigures(ReadPaperTable(programs::DataFolder() / kPaperTable), &table);
  return RenderBenchmarkTable(table, options.format, style);
}

ExitCode Table(const Options& options) {
  const std::string text = Render(options);
  Print(options.format == TableFormat::kCsv ? CsvFor(StandardOutput(), text) : text, options.output);
  return ExitCode::kOk;
}

}  // namespace

void AddTableCommand(CLI::App& app, Invocation* invocation) {
  auto* command = app.add_subcommand("table", "Print the benchmark table of an experiment");
  const auto options = std::make_shared<Options>();
  command->add_option("ID", options->selection.experiment, "Experiment (default: the newest)")
      ->check(programs::WholeNumber(1));
  AddTableFormatOption(*command, &options->format);
  AddRuleOption(*command, &options->selection.rule);
  command->add_option("--collision", options->selection.collision, "Only methods with this model: solid or surface")
      ->check(programs::OneOf({"solid", "surface"}));
  auto* paper = command->add_flag("--paper", options->paper, "Show the paper's Table I beside it");
  command
      ->add_flag("--interpolation", options->interpolation,
                 "Instead: what lies between the waypoints of the solved motions")
      ->excludes(paper);
  AddTimeUnitOption(*command, &options->time_unit);
  AddOutputOptions(*command, &options->output);
  AddSourceOptions(*command, &options->source);
  command->callback([=] { invocation->body = [options] { return Table(*options); }; });
}

}  // namespace legopt::client

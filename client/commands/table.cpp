#include <memory>
#include <optional>

#include "app/command_line.h"
#include "app/data_folder.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/compare/statistics_table.h"
#include "client/compare/target_table.h"
#include "client/figures/figures.h"
#include "client/report/benchmark_table.h"
#include "client/report/certificate_report.h"
#include "client/report/reading.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

struct TableOptions {
  TableSelection selection;
  std::optional<Rule> rule;
  SourceOptions source;
  TableFormat format = TableFormat::kText;
  TimeUnit time_unit = kMilliseconds;
  std::vector<std::string> columns;
  OutputOptions output;
  bool interpolation = false;
  bool holding = false;
  bool statistics = false;
  bool profile = false;
  std::vector<std::string> targets;  ///< ratios to the best cost
  std::optional<double> charge_s;
  bool paper = false;
  std::optional<std::string> certificate;
  PlotOptions plot;
};

constexpr char kPaperTable[] = "paper-table1.csv";

std::vector<double> RatiosOf(const std::vector<std::string>& texts) {
  constexpr double kMost = 1e6;
  std::vector<double> ratios;
  for (const std::string& text : texts) {
    const std::optional<double> ratio = ParseNumber(text);
    if (!ratio || !(*ratio >= 1.0 && *ratio <= kMost)) {
      throw ClientError(ExitCode::kUsage,
                        "--targets: '" + text + "' is no ratio of costs from 1 to 1e6; example: --targets 1.01,1.1,2");
    }
    ratios.push_back(*ratio);
  }
  return ratios;
}

std::string RenderTable(const TableOptions& options, ResultSource* source) {
  const TableStyle style{options.time_unit, LayoutOf(options.output), options.columns};
  if (options.charge_s && !options.statistics) {
    throw ClientError(ExitCode::kUsage,
                      "--charge sets the cost of a failed run in the means of --statistics; give both");
  }
  if (options.interpolation) {
    return RenderInterpolationTable(ReadInterpolationTable(*source, options.selection), options.format, style);
  }
  if (options.holding) {
    const Listing listing = ReadHolding(*source, options.selection);
    return RenderTable(KeepColumns(TableOf(listing), style.columns), options.format, style.layout);
  }
  if (options.statistics) {
    const auto table = ReadStatisticsTable(*source, options.selection, ChargeMs(options.charge_s));
    return RenderStatisticsTable(table, options.format, style);
  }
  if (!options.targets.empty()) {
    const SolvedExperiment solves = ReadSelectedSolves(*source, options.selection);
    return RenderTargetTable(ComputeTargets(solves, options.selection.rule, RatiosOf(options.targets)), options.format,
                             style);
  }
  if (options.profile) {
    return RenderProfiles(ReadStatisticsTable(*source, options.selection), options.format, style);
  }
  BenchmarkTable table = ReadBenchmarkTable(*source, options.selection);
  const ExperimentInfo experiment = FindExperiment(*source, table.experiment_id);
  const std::optional<certify::ProblemFeasibility> known =
      options.certificate ? ReadCertificateOf(*options.certificate, experiment) : FindEmbeddedCertificate(experiment);
  if (known) AddCertifiedCounts(*source, *known, &table);
  if (options.paper) AddPaperFigures(ReadPaperTable(app::DataFolder() / kPaperTable), &table);
  return RenderBenchmarkTable(table, options.format, style);
}

// Renders the profiles; empty if they are not printed.
std::string RenderPlot(const TableOptions& options, ResultSource* source) {
  CheckPlotOptions(options.plot, options.format == TableFormat::kText);
  if (!options.plot.any()) return {};
  if (options.interpolation || options.holding) {
    throw ClientError(ExitCode::kUsage, "performance profiles are of solves: give --plot and --svg without " +
                                            std::string(options.holding ? "--holding" : "--interpolation"));
  }
  const StatisticsTable table = ReadStatisticsTable(*source, options.selection);
  return DrawPlot(ProfilePlot(table), options.plot, LayoutOf(options.output));
}

ExitCode PrintTables(TableOptions options) {
  const auto source = OpenResults(options.source);
  options.selection.rule = RuleFor(*source, options.selection.experiment, options.rule);
  const std::string drawn = RenderPlot(options, source.get());
  const std::string text = RenderTable(options, source.get()) + drawn;
  Print(options.format == TableFormat::kCsv ? CsvFor(StandardOutput(), text) : text, options.output);
  return ExitCode::kOk;
}

}  // namespace

void AddTableCommand(const app::Command& program, Invocation* invocation) {
  const auto command = program.AddCommand("table", "Print the benchmark table of an experiment");
  const auto options = std::make_shared<TableOptions>();
  command.AddOption("ID", options->selection.experiment, "Experiment (default: the newest)").Check(app::WholeNumber(1));
  AddFormatOption(command, &options->format);
  AddRuleOption(command, &options->rule);
  AddResultFilterOptions(command, &options->selection.filter);
  AddRowsOption(command, &options->selection.rows, "methods");
  AddColumnsOption(command, &options->columns);
  const auto paper = command.AddFlag("--paper", options->paper, "Show the paper's Table I beside it");
  const auto interpolation =
      command
          .AddFlag("--interpolation", options->interpolation,
                   "Show collisions between the waypoints of the solved " + std::string(kInterpolatedTask.plural))
          .Excludes(paper);
  const auto holding = command
                           .AddFlag("--holding", options->holding,
                                    "Show how many postures of the solved problems contacts and joints can hold, at "
                                    "waypoints and half way between them")
                           .Excludes(paper)
                           .Excludes(interpolation);
  const auto statistics =
      command
          .AddFlag("--statistics", options->statistics,
                   "Print confidence intervals of success, quantiles, PAR10 and means over commonly solved problems")
          .Excludes(paper)
          .Excludes(interpolation)
          .Excludes(holding);
  command
      .AddList("--targets", options->targets,
               "Print how many runs reach a cost of at most these multiples of the best known cost, and the expected "
               "effort, e.g. 1.01,1.1,2")
      .Excludes(paper)
      .Excludes(interpolation)
      .Excludes(holding)
      .Excludes(statistics);
  command
      .AddFlag("--profile", options->profile,
               "Print performance profiles as steps, for plots with --format csv or json")
      .Excludes(paper)
      .Excludes(interpolation)
      .Excludes(holding)
      .Excludes(statistics);
  command
      .AddOption(
          "--certificate", options->certificate,
          "Count over the problems that this certificate, or the one in this dataset folder, certifies (default: "
          "those of the embedded datasets, for experiments with them)")
      .Excludes(interpolation)
      .Excludes(statistics);
  AddChargeOption(command, &options->charge_s);
  AddPlotOptions(command, "the performance profiles", &options->plot);
  AddTimeUnitOption(command, &options->time_unit);
  AddOutputOptions(command, &options->output);
  AddSourceOptions(command, &options->source);
  command.WhenChosen([=] { invocation->body = [options] { return PrintTables(*options); }; });
}

}  // namespace legopt::client

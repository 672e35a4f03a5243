#include <algorithm>
#include <memory>

#include "app/command_line.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/compare/comparison_report.h"
#include "client/figures/figures.h"

namespace legopt::client {
namespace {

struct CompareOptions {
  ComparisonRequest request;
  double margin_percent = 0.0;
  std::optional<double> charge_s;
  bool fail_if_worse = false;
  TableFormat format = TableFormat::kText;
  TimeUnit time_unit = kMilliseconds;
  std::vector<std::string> columns;
  OutputOptions output;
  PlotOptions plot;
};

void RequireSides(const ComparisonRequest& request) {
  const bool control = !request.control.empty();
  if (control && !request.a.empty()) {
    throw ClientError(ExitCode::kUsage, "--control takes the place of A and B; give one or the other");
  }
  if (!control && request.b.empty()) {
    throw ClientError(ExitCode::kUsage, "two sides are compared: give A and B, or --control METHOD");
  }
}

ExitCode Compare(const CompareOptions& options) {
  constexpr double kPercent = 0.01;
  RequireSides(options.request);
  ComparisonRequest request = options.request;
  request.options.margin = kPercent * options.margin_percent;
  request.charge_ms = ChargeMs(options.charge_s);
  CheckPlotOptions(options.plot, options.format == TableFormat::kText);
  const Comparison comparison = ReadComparison(request);
  const TextLayout layout = LayoutOf(options.output);
  const std::string drawn =
      options.plot.any() ? DrawPlot(ScatterPlot(comparison, options.time_unit), options.plot, layout) : "";
  const std::string text =
      RenderComparison(comparison, options.format, {options.time_unit, layout, options.columns}) + drawn;
  Print(options.format == TableFormat::kCsv ? CsvFor(StandardOutput(), text) : text, options.output);
  const bool worse = std::any_of(comparison.cells.begin(), comparison.cells.end(),
                                 [](const CellComparison& cell) { return cell.change == ComparisonResult::kWorse; });
  return options.fail_if_worse && worse ? ExitCode::kWorse : ExitCode::kOk;
}

}  // namespace

void AddCompareCommand(const app::Command& program, Invocation* invocation) {
  constexpr double kLargestMargin_percent = 1000.0;
  constexpr int kLargestFamily = 1'000;  // beyond it, the resamples do not reach the tails
  const auto command = program.AddCommand("compare", "Compare two methods, experiments or database files by problems");
  const auto options = std::make_shared<CompareOptions>();
  ComparisonRequest& request = options->request;
  command.AddOption(
      "A", request.a,
      "A method (SQP, or SQP:multi_starts=10 where there are several), an experiment (number or name), or "
      "a database file");
  command.AddOption("B", request.b, "Second method, experiment or file; of the same kind");
  command.AddOption("--control", request.control,
                    "Instead of A and B: compare every other method of the experiment with this one");
  command
      .AddOption("--experiment", request.experiment, "Experiment of both methods, or of both files (default: newest)")
      .Check(app::WholeNumber(1));
  AddResultFilterOptions(command, &request.filter);
  AddRowsOption(command, &request.rows, "comparisons");
  AddColumnsOption(command, &options->columns);
  AddRuleOption(command, &request.rule);
  command
      .AddOption("--margin", options->margin_percent,
                 "Smallest difference of times and costs to report, percent (default 0)")
      .Check(app::Number(0, kLargestMargin_percent));
  AddChargeOption(command, &options->charge_s);
  command
      .AddOption(
          "--family", request.options.family,
          "Number of comparisons in the whole document: p and intervals are adjusted for so many (default: those "
          "shown)")
      .Check(app::WholeNumber(1, kLargestFamily));
  command.AddFlag("--fail-if-worse", options->fail_if_worse,
                  "Exit with " + std::to_string(static_cast<int>(ExitCode::kWorse)) +
                      " where B is worse in any of the comparisons");
  AddFormatOption(command, &options->format);
  AddPlotOptions(command, "the times of both, problem by problem,", &options->plot);
  AddTimeUnitOption(command, &options->time_unit);
  AddOutputOptions(command, &options->output);
  AddSourceOptions(command, &request.source);
  command.WhenChosen([=] { invocation->body = [options] { return Compare(*options); }; });
}

}  // namespace legopt::client

#include "client/commands/options.h"

#include <cstdint>
#include <iostream>
#include <limits>
#include <string>
#include <vector>

#include "app/command_line.h"
#include "bus/message_limits.h"
#include "client/client_error.h"
#include "client/plot/drawing.h"
#include "client/plot/plot.h"
#include "client/report/output.h"
#include "legopt/types/task.h"

namespace legopt::client {
namespace {

// Returns the tasks with problems of different length, "motion".
std::string LongTasks() {
  std::vector<std::string> words;
  for (const TaskDescription& description : kTasks) {
    if (description.most_stances > 1) words.emplace_back(ToString(description.task));
  }
  return app::Alternatives(words);
}

}  // namespace

void AddNetworkOptions(const app::Command& command, NetworkOptions* options) {
  constexpr double kShortestTimeout_s = 0.01, kLongestTimeout_s = 3600;
  app::AddNetworkFlags(command, options);
  command.AddOption("--timeout", options->timeout_s, "Seconds to wait for an answer of the server (default 5)")
      .Check(app::Number(kShortestTimeout_s, kLongestTimeout_s))
      .Group(app::kNetworkHeading);
  command
      .AddOption("--access", options->access,
                 "Reach the server without multicast, at the addresses in this file of 'legopt-server --listen'")
      .ValueName("FILE")
      .Group(app::kNetworkHeading);
}

void AddSourceOptions(const app::Command& command, SourceOptions* options) {
  command.AddOption("--db", options->db, "Read this database file (read-only) instead of asking the server");
  AddNetworkOptions(command, &options->network);
  options->announce = PrintRemark;
}

void AddFormatOption(const app::Command& command, TableFormat* format) {
  command.AddChoice<TableFormat>("--format", *format, "text, markdown, latex, csv or json (default text)",
                                 {{"text", TableFormat::kText},
                                  {"markdown", TableFormat::kMarkdown},
                                  {"md", TableFormat::kMarkdown},
                                  {"latex", TableFormat::kLatex},
                                  {"tex", TableFormat::kLatex},
                                  {"csv", TableFormat::kCsv},
                                  {"json", TableFormat::kJson}});
}

void AddLayoutOptions(const app::Command& command, OutputOptions* options) {
  constexpr std::size_t kLargestWidth = 10'000;
  command.AddOption("--width", options->width, "Maximum line width (default: the terminal's; otherwise no limit)")
      .Check(app::WholeNumber(kSmallestWidth, kLargestWidth));
  command.AddChoice<ColorChoice>(
      "--color", options->color, "Colour: auto (default, on a terminal, not with NO_COLOR), always or never",
      {{"auto", ColorChoice::kAuto}, {"always", ColorChoice::kAlways}, {"never", ColorChoice::kNever}});
}

void AddOutputOptions(const app::Command& command, OutputOptions* options) {
  AddLayoutOptions(command, options);
  command.AddFlag("--no-pager", options->no_pager, "Do not use a pager (LEGOPT_PAGER, PAGER or less) for long text");
}

void AddRowsOption(const app::Command& command, std::vector<std::string>* rows, const std::string& noun,
                   const std::string& name) {
  command.AddOption(name, *rows, "Show only these " + noun + ", by position: numbers and ranges, e.g. 1-3,5")
      .OneArgumentEach();
}

void AddColumnsOption(const app::Command& command, std::vector<std::string>* columns) {
  // Split later, when the columns are known: a column name may contain a comma.
  command.AddOption("--columns", *columns, "Show only these columns, in this order").OneArgumentEach();
}

void AddListingOptions(const app::Command& command, ListingOptions* options) {
  AddFormatOption(command, &options->format);
  AddRowsOption(command, &options->rows);
  AddColumnsOption(command, &options->columns);
  AddOutputOptions(command, &options->output);
}

void AddTimeUnitOption(const app::Command& command, TimeUnit* unit) {
  command.AddChoice<TimeUnit>("--time-unit", *unit, "Unit of the times in text: s, ms (default) or us",
                              {{"s", kSeconds}, {"ms", kMilliseconds}, {"us", kMicroseconds}});
}

Table SelectedPart(Table table, const ListingOptions& options) {
  KeepRows(options.rows, &table.rows);
  return KeepColumns(table, options.columns);
}

void PrintTable(const Table& table, const ListingOptions& options) {
  const std::string text = RenderTable(SelectedPart(table, options), options.format, LayoutOf(options.output));
  Print(options.format == TableFormat::kCsv ? CsvFor(StandardOutput(), text) : text, options.output);
}

void PrintListing(const Listing& listing, const ListingOptions& options) { PrintTable(TableOf(listing), options); }

void PrintPlain(const Listing& listing, TableFormat format) {
  const std::string text = RenderListing(listing, format);
  std::cout << (format == TableFormat::kCsv ? CsvFor(StandardOutput(), text) : text) << std::flush;
}

void AddPlotOptions(const app::Command& command, const std::string& what, PlotOptions* options) {
  command.AddFlag("--plot", options->text, "Draw " + what + " below it, in text");
  const auto is_png = [](const std::string& word) {
    return word.ends_with(".png") || word.ends_with(".PNG") ? "figures are SVG files; give a name that ends in .svg"
                                                            : "";
  };
  command.AddOption("--svg", options->svg, "Draw " + what + " into this SVG file").Check({is_png, ""});
  command.AddOption("--png", options->removed_png, "").Group("");
}

void CheckPlotOptions(const PlotOptions& options, bool is_text) {
  if (!options.removed_png.empty()) {
    throw ClientError(ExitCode::kUsage, "--png: figures are SVG files; give --svg FILE.svg instead");
  }
  if (!options.text || is_text) return;
  throw ClientError(ExitCode::kUsage, "--plot draws below the text table; with another --format give --svg FILE");
}

std::string DrawPlot(const Plot& plot, const PlotOptions& options, const TextLayout& layout) {
  if (!options.svg.empty()) ReplaceFile(options.svg, RenderFigure(plot, PlotFormat::kSvg));
  return options.text ? "\n" + RenderPlotText(plot, layout) : "";
}

void AddRuleOption(const app::Command& command, std::optional<Rule>* rule, const std::string& by_default) {
  command.AddEnum<Rule>("--rule", *rule,
                        "Count success by this rule: literal (original evaluator), strict (every listed link pair), "
                        "solid (bodies are solid, contacts touch) or physical (friction and efforts hold the robot) "
                        "(default: " +
                            by_default + ")");
}

void AddTextOrJsonOption(const app::Command& command, bool* json) {
  command.AddChoice<bool>("--format", *json, "text or json (default text)", {{"text", false}, {"json", true}});
}

void AddPatienceOption(const app::Command& command, double* patience_s) {
  constexpr double kLongest_s = 1e8;
  command
      .AddOption("--patience", *patience_s,
                 "Seconds to wait for a server that stops answering, e.g. because it is restarted (default 600)")
      .Check(app::Number(0, kLongest_s));
}

void AddGiveUpOption(const app::Command& command, std::optional<double>* give_up_s) {
  constexpr double kShortest_s = 0.1, kLongest_s = 1e8;
  command
      .AddOption("--give-up", *give_up_s,
                 "End with exit code 15 and the reason after SECONDS without progress (default: wait)")
      .ValueName("SECONDS")
      .Check(app::Number(kShortest_s, kLongest_s));
}

std::optional<std::chrono::duration<double>> GiveUpOf(const std::optional<double>& give_up_s) {
  return give_up_s ? std::optional(std::chrono::duration<double>(*give_up_s)) : std::nullopt;
}

void AddChargeOption(const app::Command& command, std::optional<double>* charge_s) {
  constexpr double kLeast_s = 1e-6, kMost_s = 1e9;
  command
      .AddOption("--charge", *charge_s,
                 "Seconds that a failed run costs in means of times (default: 10 for each waypoint of the problem; "
                 "where effort has no limit, ten limits of wall time)")
      .Check(app::Number(kLeast_s, kMost_s));
}

std::optional<double> ChargeMs(const std::optional<double>& charge_s) {
  constexpr double kMillisecondsPerSecond = 1e3;
  return charge_s ? std::optional(kMillisecondsPerSecond * *charge_s) : std::nullopt;
}

void AddDatasetOption(const app::Command& command, std::optional<std::string>* dataset) {
  command.AddOption("--dataset", *dataset, "Dataset folder (default: the suite's, else the embedded garage-easier)");
}

void AddSuiteOptions(const app::Command& command, SuiteOptions* options) {
  using app::Joined, app::EnumNamesOf;
  command
      .AddOption("SUITE", options->suite,
                 "Experiment file (YAML), - for standard input, or the name of an embedded suite, e.g. quick")
      .Required();
  AddDatasetOption(command, &options->dataset);
  command.AddOption("--solver", options->solvers,
                    "Description file of an external solver that the suite names; may be repeated "
                    "(docs/reference/external-solvers.md)");
  // Split later, when the suite is read: a method name may contain a comma.
  command.AddOption("--methods", options->filter.methods, "Keep only these methods, by name").OneArgumentEach();
  command.AddList("--multi-starts", options->filter.multi_starts, "Keep only methods with these numbers of restarts");
  command.AddList("--sample-size", options->filter.sample_sizes, "Keep only methods with these sample sizes, percent");
  command.AddList("--tasks", options->filter.tasks, "Keep only these tasks: " + Joined(EnumNamesOf<Task>()));
  command.AddList("--problems", options->filter.problems, "Keep only these problems: ids and ranges, e.g. 0-9,12");
  command.AddList("--initializations", options->filter.initializations,
                  "Keep only these: " + Joined(EnumNamesOf<Initialization>()));
  command.AddList("--collision", options->filter.collision,
                  "Keep only methods with these models: " + Joined(EnumNamesOf<SceneRepresentation>()));
  command.AddOption("--max-stances", options->filter.max_stances, "Omit longer " + LongTasks() + " problems")
      .Check(app::WholeNumber(2, bus::spec_limits::kMaxWaypoints));
  command.AddEnum<Split>("--split", options->filter.split,
                         "Problems to tune on (even ids) or to report on (odd ids): " + Joined(EnumNamesOf<Split>()));
  command.AddOption("--seed", options->filter.seed, "Seed of the experiment, instead of the suite's")
      .Check(app::WholeNumber(0));
  command.AddFlag("--null", options->null_row,
                  "Add a copy of the first method, to measure how much times of the same work differ; no results are "
                  "reused from identical jobs");
  command.AddFlag("--again,--new", options->fresh,
                  "Re-run everything as another experiment, although an identical one exists; no results are reused "
                  "from identical jobs");
}

}  // namespace legopt::client

#include "client/commands/options.h"

#include <CLI/CLI.hpp>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "legopt/nearest_name.h"
#include "programs/checks.h"

namespace legopt::client {
namespace {

// A flag whose values are words; the error names them and the nearest one.
template <class Choice>
void AddNamedChoice(CLI::App& app, const std::string& flag, Choice* target, const std::string& help,
                    std::vector<std::pair<std::string, Choice>> choices) {
  const auto choose = [flag, target, choices = std::move(choices)](const std::string& word) {
    std::vector<std::string> names;
    for (const auto& [name, choice] : choices) {
      if (name == word) {
        *target = choice;
        return;
      }
      names.push_back(name);
    }
    throw CLI::ValidationError(flag, "'" + word + "' is not known; " + SuggestName(word, names));
  };
  app.add_option_function<std::string>(flag, choose, help)->type_name("WORD");
}

// A comma-separated list that takes one argument, so that it does not swallow what follows.
void AddList(CLI::App& app, const std::string& flag, std::vector<std::string>* target, const std::string& help) {
  app.add_option(flag, *target, help)->delimiter(',')->allow_extra_args(false)->type_name("LIST");
}

}  // namespace

void AddNetworkOptions(CLI::App& app, NetworkOptions* options) {
  constexpr double kShortestTimeout_s = 0.01, kLongestTimeout_s = 3600;
  programs::AddNetworkFlags(app, options);
  app.add_option("--timeout", options->timeout_s, "Seconds to wait for an answer of the server (default 5)")
      ->check(programs::Number(kShortestTimeout_s, kLongestTimeout_s))
      ->group(programs::kNetworkHeading);
}

void AddSourceOptions(CLI::App& app, SourceOptions* options) {
  app.add_option("--db", options->db, "Read this database file (read-only) instead of asking the server");
  AddNetworkOptions(app, &options->network);
}

void AddFormatOption(CLI::App& app, ListingFormat* format) {
  AddNamedChoice<ListingFormat>(app, "--format", format, "text, markdown, csv or json (default text)",
                                {{"text", ListingFormat::kText},
                                 {"markdown", ListingFormat::kMarkdown},
                                 {"md", ListingFormat::kMarkdown},
                                 {"csv", ListingFormat::kCsv},
                                 {"json", ListingFormat::kJson}});
}

void AddOutputOptions(CLI::App& app, OutputOptions* options) {
  constexpr std::size_t kLargestWidth = 10'000;
  app.add_option("--width", options->width, "Columns that text fits into (default: the terminal's; else no limit)")
      ->check(programs::WholeNumber(kSmallestWidth, kLargestWidth));
  AddNamedChoice<ColorChoice>(
      app, "--color", &options->color, "Colour: auto (default, on a terminal, not with NO_COLOR), always or never",
      {{"auto", ColorChoice::kAuto}, {"always", ColorChoice::kAlways}, {"never", ColorChoice::kNever}});
  app.add_flag("--no-pager", options->no_pager, "Do not show long text by LEGOPT_PAGER, PAGER or less");
}

void AddListingOptions(CLI::App& app, ListingOptions* options) {
  AddFormatOption(app, &options->format);
  AddList(app, "--columns", &options->columns, "Show only these columns, in this order");
  AddOutputOptions(app, &options->output);
}

void AddTimeUnitOption(CLI::App& app, TimeUnit* unit) {
  AddNamedChoice<TimeUnit>(app, "--time-unit", unit, "Unit of the times in text: s, ms (default) or us",
                           {{"s", kSeconds}, {"ms", kMilliseconds}, {"us", kMicroseconds}});
}

void PrintListing(const Listing& listing, const ListingOptions& options) {
  const TextLayout layout = LayoutOf(options.output);
  const std::string text = options.columns.empty()
                               ? RenderListing(listing, options.format, layout)
                               : RenderListing(KeepColumns(listing, options.columns), options.format, layout);
  Print(options.format == ListingFormat::kCsv ? CsvFor(StandardOutput(), text) : text, options.output);
}

void AddTableFormatOption(CLI::App& app, TableFormat* format) {
  AddNamedChoice<TableFormat>(app, "--format", format, "text, markdown, latex, csv or json (default text)",
                              {{"text", TableFormat::kText},
                               {"markdown", TableFormat::kMarkdown},
                               {"md", TableFormat::kMarkdown},
                               {"latex", TableFormat::kLatex},
                               {"tex", TableFormat::kLatex},
                               {"csv", TableFormat::kCsv},
                               {"json", TableFormat::kJson}});
}

void AddRuleOption(CLI::App& app, std::string* rule) {
  AddNamedChoice<std::string>(
      app, "--rule", rule,
      "Whose success counts: literal, as the original evaluator (default), or strict, every colliding pair",
      {{"literal", "literal"}, {"strict", "strict"}});
}

void AddTextOrJsonOption(CLI::App& app, bool* json) {
  AddNamedChoice<bool>(app, "--format", json, "text or json (default text)", {{"text", false}, {"json", true}});
}

void AddPatienceOption(CLI::App& app, double* patience_s) {
  constexpr double kLongest_s = 1e8;
  app.add_option("--patience", *patience_s,
                 "Seconds to wait for a server that stops answering, e.g. because it is restarted (default 600)")
      ->check(programs::Number(0, kLongest_s));
}

void AddDatasetOption(CLI::App& app, std::optional<std::string>* dataset) {
  app.add_option("--dataset", *dataset, "Dataset folder (default: the suite's, else the embedded garage-easier)");
}

void AddSuiteOptions(CLI::App& app, SuiteOptions* options) {
  app.add_option("SUITE", options->suite, "Experiment file (YAML), or the name of an embedded suite, e.g. quick")
      ->required();
  AddDatasetOption(app, &options->dataset);
  AddList(app, "--methods", &options->filter.methods, "Keep only these methods, by name");
  AddList(app, "--multi-starts", &options->filter.multi_starts, "Keep only methods with these numbers of restarts");
  AddList(app, "--sample-size", &options->filter.sample_sizes, "Keep only methods with these sample sizes, percent");
  AddList(app, "--tasks", &options->filter.tasks, "Keep only these tasks: posture, motion");
  AddList(app, "--problems", &options->filter.problems, "Keep only these problems: ids and ranges, e.g. 0-9,12");
  AddList(app, "--initializations", &options->filter.initializations, "Keep only these: good, in_collision");
  AddList(app, "--collision", &options->filter.collision, "Keep only methods with these models: solid, surface");
  app.add_option("--max-stances", options->filter.max_stances, "Leave longer motion problems out")
      ->check(programs::WholeNumber(2, 1'000'000));
  app.add_option("--seed", options->filter.seed, "Seed of the experiment, instead of the suite's")
      ->check(programs::WholeNumber(0));
  app.add_flag("--new", options->fresh, "Make a new experiment although one of the same content exists");
}

}  // namespace legopt::client

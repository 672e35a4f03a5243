#include <cmath>
#include <iostream>
#include <memory>

#include "app/checks.h"
#include "app/command_line.h"
#include "app/isolated_call.h"
#include "app/printable.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/commands/page_datasets.h"
#include "client/page/page_report.h"
#include "client/report/replaced_file.h"
#include "client/suite/chosen_files.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

constexpr double kBytesPerMegabyte = 1e6;

struct ReportOptions {
  std::vector<std::string> experiments, databases, datasets;
  std::string out;
  double max_megabytes = 25.0;
  std::optional<Rule> rule;
  ResultFilter filter;
  NetworkOptions network;
  app::BuildFacts build;
};

void Say(const std::string& text) { std::cerr << "legopt: " << app::Printable(text) << "\n"; }

// Returns every combination of file and experiment; without a file, the server's experiments.
std::vector<PageSource> SourcesOf(const ReportOptions& options) {
  std::vector<SourceOptions> places;
  for (const std::string& file : options.databases) places.push_back({file, options.network});
  if (places.empty()) places.push_back({std::nullopt, options.network});
  std::vector<PageSource> sources;
  for (const SourceOptions& place : places) {
    for (const std::string& experiment : options.experiments)
      sources.push_back({place, *ParseInteger<std::int64_t>(experiment)});
    if (options.experiments.empty()) sources.push_back({place, std::nullopt});
  }
  return sources;
}

ExitCode Report(const ReportOptions& options) {
  ReportRequest request;
  request.sources = SourcesOf(options);
  request.rule = PageRule(request.sources, options.rule);
  request.filter = options.filter;
  request.most_bytes = static_cast<std::size_t>(options.max_megabytes * kBytesPerMegabyte);
  request.build = options.build;
  request.tell = Say;
  request.datasets = LoadPageDatasets(request.sources, options.datasets);
  const Page page = MakeReport(request);
  ReplaceFile(options.out, page.text);
  for (const std::string& note : page.notes) Say("note: " + note);
  constexpr double kTenth = 10.0;
  const double megabytes = std::round(kTenth * static_cast<double>(page.text.size()) / kBytesPerMegabyte) / kTenth;
  std::cerr << app::Printable(options.out) << " written, " << megabytes << " MB\n";
  return ExitCode::kOk;
}

}  // namespace

void AddReportCommand(const app::Command& program, Invocation* invocation) {
  constexpr double kLargest_megabytes = 1000.0, kSmallest_megabytes = 1.0;
  const auto command = program.AddCommand("report", "Write one HTML file with tables, figures and solutions");
  const auto options = std::make_shared<ReportOptions>();
  command.AddOption("EXPERIMENT", options->experiments, "Experiments, beside each other (default: the newest)")
      .Check(app::WholeNumber(1));
  command.AddOption("--out", options->out, "File to write, e.g. report.html").Required();
  command.AddList("--db", options->databases,
                  "Read this database file (read-only) instead of asking the server; several: repeat it, or use commas",
                  app::IsExistingPath);
  command.AddList("--dataset", options->datasets,
                  "Dataset folder for the 3D view (default: the embedded one); several: repeat it, or use commas",
                  app::IsExistingPath);
  command
      .AddOption("--max-size", options->max_megabytes,
                 "Largest size of the file in MB; the report names whatever was left out for it (default 25)")
      .Check(app::Number(kSmallest_megabytes, kLargest_megabytes));
  AddResultFilterOptions(command, &options->filter);
  AddRuleOption(command, &options->rule);
  AddNetworkOptions(command, &options->network);
  command.WhenChosen([=] {
    options->build = invocation->build;
    invocation->body = [options] { return Report(*options); };
  });
}

}  // namespace legopt::client

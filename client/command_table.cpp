#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "client/benchmark_table.h"
#include "client/commands.h"
#include "client/options.h"
#include "client/reading.h"

namespace legopt::client {
namespace {

struct Options {
  std::optional<std::int64_t> experiment;
  SourceOptions source;
  TableFormat format = TableFormat::kText;
  std::string rule = "literal";
};

ExitCode Table(const Options& options) {
  const auto source = OpenResults(options.source);
  std::cout << RenderBenchmarkTable(ReadBenchmarkTable(*source, options.experiment, options.rule), options.format);
  return ExitCode::kOk;
}

}  // namespace

void AddTableCommand(CLI::App& app, Invocation* invocation) {
  auto* command = app.add_subcommand("table", "Print the benchmark table of an experiment");
  const auto options = std::make_shared<Options>();
  command->add_option("ID", options->experiment, "Experiment (default: the newest)");
  AddTableFormatOption(*command, &options->format);
  AddRuleOption(*command, &options->rule);
  AddSourceOptions(*command, &options->source);
  command->callback([=] { invocation->body = [options] { return Table(*options); }; });
}

}  // namespace legopt::client

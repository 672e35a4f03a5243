#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "client/chosen_files.h"
#include "client/client_error.h"
#include "client/commands.h"
#include "client/evaluation_report.h"
#include "client/options.h"

namespace legopt::client {
namespace {

struct Options {
  std::string file;
  std::optional<std::string> dataset;
  std::string rule = "literal";
  ListingFormat format = ListingFormat::kText;
};

ExitCode Evaluate(const Options& options) {
  const SolutionFile file = ReadSolutions(options.file);
  Judge judge(Dataset::Load(ChooseDatasetFolder(options.dataset, nullptr)));
  const auto report = EvaluateSolutions(file, judge, options.rule == "strict" ? Rule::kStrict : Rule::kLiteral);
  if (report.rows.empty()) {
    throw ClientError(ExitCode::kUsage, options.file + ": no problem has a 'solution'; is it a problem file?");
  }
  std::cout << RenderEvaluation(report, options.format) << std::flush;
  for (const auto& warning : report.warnings) std::cerr << "legopt: warning: " << warning << "\n";
  return ExitCode::kOk;
}

}  // namespace

void AddEvaluateCommand(CLI::App& app, Invocation* invocation) {
  auto* command =
      app.add_subcommand("evaluate", "Judge a LegOpt solution file: per method successes, mean cost, mean time");
  const auto options = std::make_shared<Options>();
  command->add_option("FILE", options->file, "LegOpt solution JSON")->required();
  AddDatasetOption(*command, &options->dataset);
  AddRuleOption(*command, &options->rule);
  AddFormatOption(*command, &options->format);
  command->callback([=] { invocation->body = [options] { return Evaluate(*options); }; });
}

}  // namespace legopt::client

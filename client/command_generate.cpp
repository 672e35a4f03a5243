#include <CLI/CLI.hpp>
#include <chrono>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "client/commands.h"
#include "client/generation_progress.h"
#include "legopt/generate/scenario.h"
#include "legopt/generate/text_file.h"

namespace legopt::client {
namespace {

struct ScenarioFlags {
  std::string kind = "garage";
  std::string level = "easier";
  std::uint64_t seed = 1;
  std::string out;
  bool no_pictures = false;
};

void AddScenarioFlags(CLI::App& app, ScenarioFlags* flags) {
  app.add_option("--kind", flags->kind, "garage or house")->capture_default_str();
  app.add_option("--level", flags->level, "easier, easy, intermediate or hard")->capture_default_str();
  app.add_option("--seed", flags->seed, "All random draws follow from it")->capture_default_str();
  app.add_option("--out", flags->out, "Folder to make; it must not exist")->required();
  app.add_flag("--no-pictures", flags->no_pictures, "Leave the PNG files out");
}

ScenarioOptions OptionsOf(const ScenarioFlags& flags) {
  ScenarioOptions options;
  options.kind = ParseBuildingKind(flags.kind);
  options.level = ParseScenarioLevel(flags.level);
  options.seed = flags.seed;
  return options;
}

ExitCode GenerateScenario(const ScenarioFlags& flags) {
  const ScenarioOptions options = OptionsOf(flags);
  NewFolder folder(flags.out, "scenario " + flags.kind + " " + flags.level + " " + std::to_string(flags.seed) + "\n");
  GenerationProgress progress;
  const Scenario scenario =
      MakeScenario(options, [&](double done, double total) { progress.Show("collapse", done, total, "s"); });
  progress.Break();
  WriteScenario(scenario, folder.path(), !flags.no_pictures);
  folder.Finish();
  std::cout << DescribeScenario(scenario).dump(2) << "\n";
  return ExitCode::kOk;
}

}  // namespace

void AddGenerateCommand(CLI::App& app, Invocation* invocation) {
  auto* generate = app.add_subcommand("generate", "Make destruction scenarios and benchmark instances from a seed");
  generate->require_subcommand(1);
  generate->fallthrough();

  auto* scenario = generate->add_subcommand("scenario", "A damaged building: mesh, manifest and pictures");
  const auto flags = std::make_shared<ScenarioFlags>();
  AddScenarioFlags(*scenario, flags.get());
  scenario->callback([=] { invocation->body = [flags] { return GenerateScenario(*flags); }; });
}

}  // namespace legopt::client

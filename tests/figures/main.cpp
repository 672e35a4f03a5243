// Measures one acceptance figure: build/tests/figures_run NAME [--count N] [--minutes M] [--strict].

#include <CLI/CLI.hpp>
#include <iostream>
#include <map>
#include <string>
#include <vector>

#include "tests/figures/figures.h"
#include "tests/folders.h"
#include "tests/service/deployment.h"

namespace legopt::figures {
namespace {

constexpr int kExitSkipped = 77;  // skip code of CTest

using Measure = void (*)(const Request&, Findings&);

const std::map<std::string, Measure>& Measures() {
  static const std::map<std::string, Measure> measures = {
      {"slots", MeasureSlotReturn},        {"limits", MeasureLimits},
      {"hostile", MeasureHostility},       {"large-file", MeasureLargeFile},
      {"readers", MeasureReaders},         {"determinism", MeasureDeterminism},
      {"start-up", MeasureStartUp},        {"soak", MeasureSoak},
      {"durability", MeasureDurability},   {"throughput", MeasureThroughput},
      {"page-readers", MeasurePageReaders}};
  return measures;
}

int Run(int argc, char** argv) {
  Request request;
  request.dataset = std::filesystem::path(SourceFolder()) / "data" / "garage-small";
  std::string name;
  bool strict = false;
  std::vector<std::string> names;
  for (const auto& [known, measure] : Measures()) names.push_back(known);
  CLI::App app("Measures acceptance figures with real processes; fails when a promise is broken.");
  app.add_option("NAME", name, "Which one; see docs/explanation/reliability.md")
      ->required()
      ->check(CLI::IsMember(names));
  app.add_option("--count", request.count, "Trials, rows, packets or problems (default: as the figure asks)")
      ->check(CLI::PositiveNumber);
  app.add_option("--minutes", request.minutes, "Length of readers, throughput and soak")->check(CLI::PositiveNumber);
  app.add_option("--seed", request.seed, "Of every random choice")->capture_default_str();
  app.add_option("--dataset", request.dataset, "Of determinism")->check(CLI::ExistingDirectory)->capture_default_str();
  app.add_flag("--strict", strict, "Fail also when a time is missed; for an idle machine");
  CLI11_PARSE(app, argc, argv);
  if (const std::string why = service::Deployment::Unavailable(); !why.empty()) {
    std::cout << "SKIPPED, NO MULTICAST HERE: " << why << std::endl;
    return kExitSkipped;
  }
  Findings findings;
  Measures().at(name)(request, findings);
  return findings.guarantees_hold() && (findings.limits_hold() || !strict) ? 0 : 1;
}

}  // namespace
}  // namespace legopt::figures

int main(int argc, char** argv) {
  try {
    return legopt::figures::Run(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "figures: " << error.what() << "\n";
    return 1;
  }
}

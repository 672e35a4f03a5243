// Runs seeded histories of the whole service with injected faults and checks that nothing is lost, done twice, or
// wrong. A failed history is printed with the command that repeats it.

#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <cstdint>
#include <iostream>

#include "tests/guarded_main.h"
#include "tests/simulation/history.h"

namespace {

struct Options {
  std::uint64_t seed = 0;
  std::uint64_t first = 1;
  std::uint64_t seeds = 100;
  bool expect_failure = false;
  bool log = false;
};

struct Totals {
  std::uint64_t histories = 0, failed = 0, datagrams = 0, server_lives = 0;
  std::int64_t jobs = 0, attempts = 0, stale = 0;
};

void Report(const char* program, std::uint64_t seed, const legopt::simulation::HistoryOutcome& outcome) {
  for (const std::string& fault : outcome.faults) std::cout << "  " << fault << "\n";
  std::cout << "reproduce: " << program << " --seed " << seed << std::endl;
}

void Play(const char* program, std::uint64_t seed, Totals* totals) {
  const auto outcome = legopt::simulation::RunHistory(seed);
  ++totals->histories;
  totals->datagrams += outcome.datagrams;
  totals->jobs += outcome.jobs;
  totals->attempts += outcome.attempts;
  totals->stale += outcome.stale;
  totals->server_lives += outcome.server_lives;
  if (outcome.faults.empty()) return;
  ++totals->failed;
  Report(program, seed, outcome);
}

int Run(const char* program, const Options& options) {
  Totals totals;
  const std::uint64_t first = options.seed != 0 ? options.seed : options.first;
  const std::uint64_t count = options.seed != 0 ? 1 : options.seeds;
  for (std::uint64_t seed = first; seed < first + count; ++seed) {
    Play(program, seed, &totals);
    if (options.expect_failure && totals.failed > 0) break;
  }
  std::cout << totals.histories << " histories, " << totals.failed << " failed; " << totals.jobs << " jobs, "
            << totals.attempts << " attempts, " << totals.stale << " stale reports, " << totals.server_lives
            << " server lives, " << totals.datagrams << " datagrams" << std::endl;
  return (totals.failed > 0) == options.expect_failure ? 0 : 1;
}

int RunRequested(int argc, char** argv) {
  Options options;
  CLI::App app("Simulates server, workers and clients under seeded misfortune in virtual time.");
  app.add_option("--seed", options.seed, "Play this one history");
  app.add_option("--first", options.first, "Seed of the first history")->capture_default_str();
  app.add_option("--seeds", options.seeds, "How many histories")->capture_default_str();
  app.add_flag("--expect-failure", options.expect_failure, "Succeed when a history fails, for planted faults");
  app.add_flag("--log", options.log, "Show what the server logs");
  CLI11_PARSE(app, argc, argv);
  spdlog::set_level(options.log ? spdlog::level::debug : spdlog::level::off);
  return Run(argv[0], options);
}

}  // namespace

int main(int argc, char** argv) { return legopt::GuardedMain(argc, argv, RunRequested); }

#include <chrono>
#include <iostream>
#include <memory>

#include "app/checks.h"
#include "app/command_line.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/report/watch_json.h"
#include "client/report/watching.h"
#include "client/service/interrupt.h"

namespace legopt::client {
namespace {

constexpr double kShortestInterval_s = 0.01, kLongestInterval_s = 3600;

struct WatchCommandOptions {
  std::optional<std::int64_t> experiment;
  double patience_s = WatchOptions::kDefaultPatience_s;
  double interval_s = 1;
  std::optional<double> give_up_s;
  bool json = false;
  NetworkOptions network;
};

// Returns the newest active experiment, or else the newest one.
std::int64_t DefaultExperiment(ServerConnection& server) {
  const auto experiments = ParseExperiments(server.Status(0));
  const ExperimentStatus* chosen = nullptr;
  for (const auto& experiment : experiments) {
    const bool better = chosen == nullptr || (chosen->over() && !experiment.over()) ||
                        (chosen->over() == experiment.over() && chosen->id < experiment.id);
    if (better) chosen = &experiment;
  }
  if (chosen == nullptr) {
    throw ClientError(ExitCode::kUsage, "there is no experiment to watch; submit one with 'legopt submit SUITE'");
  }
  return chosen->id;
}

WatchOptions HowToWatch(const WatchCommandOptions& options) {
  return {Seconds(options.patience_s), !options.experiment, {}, false, GiveUpOf(options.give_up_s)};
}

ExitCode WatchAsText(ServerConnection& server, std::int64_t id, const WatchCommandOptions& options) {
  try {
    const auto status = WatchOnTerminal(server, id, HowToWatch(options));
    if (const auto hint = FailureHint(status, ""); !hint.empty()) std::cerr << "legopt: " << hint << "\n";
    return OutcomeOf(status);
  } catch (const ClientError& error) {
    if (error.code() != ExitCode::kInterrupted) throw;
    std::cerr << "\nlegopt: experiment " << id << " continues unwatched; 'legopt watch " << id << "' returns to it\n";
    return ExitCode::kInterrupted;
  }
}

// The last line always reports the end and its reason.
ExitCode WatchAsJson(ServerConnection& server, std::int64_t id, const WatchCommandOptions& options) {
  using std::chrono::microseconds;
  WatchJson view(
      id, Seconds(options.interval_s), [] { return Seconds(std::chrono::steady_clock::now().time_since_epoch()); },
      [] { return std::chrono::system_clock::now().time_since_epoch() / microseconds(1); },
      [](const std::string& line) { std::cout << line << std::endl; });
  try {
    const ExitCode outcome = OutcomeOf(WatchExperiment(server, id, view, HowToWatch(options)));
    view.End(outcome, "");
    return outcome;
  } catch (const ClientError& error) {
    view.End(error.code(), error.what());
    if (error.code() == ExitCode::kInterrupted) return ExitCode::kInterrupted;
    throw;
  }
}

ExitCode Watch(const WatchCommandOptions& options) {
  const InterruptGuard guard;
  ServerConnection server(options.network);
  const std::int64_t id = options.experiment ? *options.experiment : DefaultExperiment(server);
  return options.json ? WatchAsJson(server, id, options) : WatchAsText(server, id, options);
}

}  // namespace

void AddWatchCommand(const app::Command& program, Invocation* invocation) {
  const auto command = program.AddCommand("watch", "Show the progress of an experiment until it ends");
  const auto options = std::make_shared<WatchCommandOptions>();
  command.AddOption("ID", options->experiment, "Experiment (default: the newest that runs)").Check(app::WholeNumber(1));
  AddPatienceOption(command, &options->patience_s);
  AddGiveUpOption(command, &options->give_up_s);
  AddTextOrJsonOption(command, &options->json);
  command.AddOption("--interval", options->interval_s, "With --format json: seconds between two lines (default 1)")
      .Check(app::Number(kShortestInterval_s, kLongestInterval_s));
  AddNetworkOptions(command, &options->network);
  command.SetFooter(
      "Exit codes: 0 done, 3 the server did not come back, 4 jobs died or could not run, "
      "6 it came back with another database, 8 cancelled or interrupted, 15 nothing moved for --give-up seconds.\n"
      "--format json writes one object per line; the last one has the event \"end\". Fields: "
      "docs/how-to/watching.md");
  command.WhenChosen([=] { invocation->body = [options] { return Watch(*options); }; });
}

}  // namespace legopt::client

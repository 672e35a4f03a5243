#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "client/client_error.h"
#include "client/commands.h"
#include "client/interrupt.h"
#include "client/options.h"
#include "client/watching.h"

namespace legopt::client {
namespace {

struct Options {
  std::optional<std::int64_t> experiment;
  NetworkOptions network;
};

// The newest one that still runs, else the newest one.
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

ExitCode Watch(const Options& options) {
  const InterruptGuard guard;
  ServerConnection server(options.network);
  const std::int64_t id = options.experiment ? *options.experiment : DefaultExperiment(server);
  try {
    const auto status = WatchExperiment(server, id);
    if (const auto hint = FailureHint(status, ""); !hint.empty()) std::cerr << "legopt: " << hint << "\n";
    return OutcomeOf(status);
  } catch (const ClientError& error) {
    if (error.code() != ExitCode::kInterrupted) throw;
    std::cerr << "\nlegopt: experiment " << id << " goes on without a watcher; 'legopt watch " << id
              << "' returns to it\n";
    return ExitCode::kInterrupted;
  }
}

}  // namespace

void AddWatchCommand(CLI::App& app, Invocation* invocation) {
  auto* command = app.add_subcommand("watch", "Show the progress of an experiment until it is over");
  const auto options = std::make_shared<Options>();
  command->add_option("ID", options->experiment, "Experiment (default: the newest that runs)");
  AddNetworkOptions(*command, &options->network);
  command->footer(
      "The exit code tells how it ended: 0 done, 4 jobs died or could not run, 8 cancelled or interrupted.");
  command->callback([=] { invocation->body = [options] { return Watch(*options); }; });
}

}  // namespace legopt::client

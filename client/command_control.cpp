// How an experiment is worked on: pause, resume, hold, release, priority, retry.

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <string>

#include "client/client_error.h"
#include "client/commands.h"
#include "client/options.h"

namespace legopt::client {
namespace {

// control_request.action, lcmtypes/control_request.lcm.
enum class Action : std::int8_t { kPause, kResume, kHold, kRelease, kPriority, kRetry };

constexpr int kMostPriority = 1000;

struct Options {
  std::int64_t experiment = 0;
  Action action{};
  std::string reason;
  int priority = 0;
  NetworkOptions network;
};

std::string Done(Action action, std::int64_t num_jobs, int priority) {
  const std::string jobs = std::to_string(num_jobs) + (num_jobs == 1 ? " job" : " jobs");
  switch (action) {
    case Action::kPause:
      return "paused; running jobs finish, no other begins until 'legopt resume'";
    case Action::kResume:
      return "goes on";
    case Action::kHold:
      return "held, " + jobs + " given back; 'legopt release' lets it go on";
    case Action::kRelease:
      return "released";
    case Action::kPriority:
      return "priority " + std::to_string(priority);
    case Action::kRetry:
      break;
  }
  return jobs + " queued again";
}

ExitCode Control(const Options& options) {
  legopt_msg::control_request request{};
  request.experiment_id = options.experiment;
  request.action = static_cast<std::int8_t>(options.action);
  request.priority = options.priority;
  request.reason = options.reason;
  ServerConnection server(options.network);
  const auto reply = server.Control(request);
  if (reply.status != 0) throw ClientError(ExitCode::kUsage, reply.message + "; see 'legopt status'");
  std::cout << "experiment " << options.experiment << ": " << Done(options.action, reply.num_jobs, options.priority)
            << "\n";
  if (!reply.message.empty()) std::cerr << "legopt: " << reply.message << "\n";
  return ExitCode::kOk;
}

CLI::App* AddAction(CLI::App& app, Invocation* invocation, const char* name, const char* help,
                    const std::shared_ptr<Options>& options) {
  auto* command = app.add_subcommand(name, help);
  command->add_option("ID", options->experiment, "Experiment")->required()->check(CLI::PositiveNumber);
  AddNetworkOptions(*command, &options->network);
  command->callback([=] { invocation->body = [options] { return Control(*options); }; });
  return command;
}

std::shared_ptr<Options> For(Action action) {
  const auto options = std::make_shared<Options>();
  options->action = action;
  return options;
}

}  // namespace

void AddControlCommands(CLI::App& app, Invocation* invocation) {
  AddAction(app, invocation, "pause", "Begin no more jobs of an experiment; running ones finish", For(Action::kPause));
  AddAction(app, invocation, "resume", "Go on with a paused experiment", For(Action::kResume));
  const auto hold = For(Action::kHold);
  AddAction(app, invocation, "hold", "Stop an experiment for a reason; running jobs are given back, not charged", hold)
      ->add_option("REASON", hold->reason, "Why, for those who see it in 'legopt status'")
      ->required();
  AddAction(app, invocation, "release", "Go on with a held experiment", For(Action::kRelease));
  const auto priority = For(Action::kPriority);
  AddAction(app, invocation, "priority", "Begin an experiment's jobs before or after those of others", priority)
      ->add_option("PRIORITY", priority->priority, "Larger is earlier; experiments begin with 0")
      ->required()
      ->check(CLI::Range(-kMostPriority, kMostPriority));
  AddAction(app, invocation, "retry", "Queue the failed and dead jobs of an experiment again", For(Action::kRetry));
}

}  // namespace legopt::client

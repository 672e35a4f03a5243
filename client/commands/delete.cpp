// Deletes an experiment permanently, after confirmation.

#include <unistd.h>

#include <iostream>
#include <memory>
#include <string>

#include "app/checks.h"
#include "app/command_line.h"
#include "app/printable.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/service/experiment_status.h"
#include "legopt/types/reply.h"

namespace legopt::client {
namespace {

struct DeleteOptions {
  std::int64_t experiment = 0;
  bool yes = false;
  NetworkOptions network;
};

std::string Count(std::int64_t number, const std::string& word) {
  return std::to_string(number) + " " + word + (number == 1 ? "" : "s");
}

// Returns e.g. "experiment 3 'quick': 540 jobs, 540 results".
std::string Describe(const ExperimentStatus& status) {
  return "experiment " + std::to_string(status.id) + " '" + app::Printable(status.name) +
         "': " + Count(status.total, "job") + ", " + Count(status.done, "result");
}

// Asks for confirmation at the terminal; scripts must use --yes.
bool Confirmed(const std::string& what) {
  if (isatty(STDIN_FILENO) == 0 || isatty(STDERR_FILENO) == 0) {
    throw ClientError(ExitCode::kUsage, what + ": would be deleted for good; if that is meant, say --yes");
  }
  std::cerr << what << "\nDelete it for good, with all attempts and solutions? [y/N] " << std::flush;
  std::string answer;
  std::getline(std::cin, answer);
  return answer == "y" || answer == "Y" || answer == "yes";
}

ExitCode Delete(const DeleteOptions& options) {
  const std::string name = "experiment " + std::to_string(options.experiment);
  ServerConnection server(options.network);
  const auto found = ParseExperiments(server.Status(options.experiment));
  if (found.empty()) throw ClientError(ExitCode::kUsage, "there is no " + name + "; see 'legopt status'");
  if (!found.front().over()) {
    throw ClientError(ExitCode::kUsage,
                      name + " is active; cancel it first: 'legopt cancel " + std::to_string(options.experiment) + "'");
  }
  const std::string what = Describe(found.front());
  if (!options.yes && !Confirmed(what)) {
    std::cerr << "legopt: " << name << " is kept\n";
    return ExitCode::kInterrupted;
  }
  legopt_msg::control_request request{};
  request.experiment_id = options.experiment;
  request.action = static_cast<std::int8_t>(ControlAction::kDelete);
  const auto reply = server.Control(request);
  if (ControlStatus{reply.status} != ControlStatus::kOk) throw ClientError(ExitCode::kUsage, reply.message);
  std::cout << what << ": deleted\n";
  return ExitCode::kOk;
}

}  // namespace

void AddDeleteCommand(const app::Command& program, Invocation* invocation) {
  const auto command =
      program.AddCommand("delete", "Delete a finished experiment with its jobs and results, permanently");
  const auto options = std::make_shared<DeleteOptions>();
  command.AddOption("ID", options->experiment, "Experiment").Required().Check(app::WholeNumber(1));
  command.AddFlag("--yes", options->yes, "Do not ask");
  AddNetworkOptions(command, &options->network);
  command.WhenChosen([=] { invocation->body = [options] { return Delete(*options); }; });
}

}  // namespace legopt::client

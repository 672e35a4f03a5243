#include <iostream>
#include <memory>

#include "app/checks.h"
#include "app/command_line.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "legopt/types/reply.h"

namespace legopt::client {
namespace {

struct CancelOptions {
  std::int64_t experiment = 0;
  NetworkOptions network;
};

ExitCode Cancel(const CancelOptions& options) {
  ServerConnection server(options.network);
  const auto reply = server.Cancel(options.experiment);
  if (ControlStatus{reply.status} != ControlStatus::kOk) {
    throw ClientError(ExitCode::kUsage, "experiment " + std::to_string(options.experiment) +
                                            " cannot be cancelled: " + reply.message + "; see 'legopt status'");
  }
  std::cout << "experiment " << options.experiment << ": " << reply.num_jobs
            << " jobs cancelled; finished results are kept\n";
  return ExitCode::kOk;
}

}  // namespace

void AddCancelCommand(const app::Command& program, Invocation* invocation) {
  const auto command = program.AddCommand("cancel", "Cancel an experiment; finished jobs are kept");
  const auto options = std::make_shared<CancelOptions>();
  command.AddOption("ID", options->experiment, "Experiment").Required().Check(app::WholeNumber(1));
  AddNetworkOptions(command, &options->network);
  command.WhenChosen([=] { invocation->body = [options] { return Cancel(*options); }; });
}

}  // namespace legopt::client

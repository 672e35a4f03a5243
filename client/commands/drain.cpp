#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/command_line.h"
#include "app/printable.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "legopt/input/json.h"
#include "legopt/types/reply.h"

namespace legopt::client {
namespace {

struct DrainOptions {
  std::string worker;
  NetworkOptions network;
};

// Returns the connected workers with this number or name; several workers may share a name.
std::vector<std::int64_t> Find(const nlohmann::json& workers, const std::string& wanted) {
  std::vector<std::int64_t> found;
  for (const auto& worker : workers) {
    if (!worker.value("online", false)) continue;
    if (Dump(worker.at("id")) == wanted) return {worker.at("id").get<std::int64_t>()};
    if (worker.value("name", "") == wanted) found.push_back(worker.at("id").get<std::int64_t>());
  }
  return found;
}

ExitCode Drain(const DrainOptions& options) {
  ServerConnection server(options.network);
  const std::vector<std::int64_t> found =
      Find(server.Status(0).value("workers", nlohmann::json::array()), options.worker);
  if (found.empty()) {
    throw ClientError(ExitCode::kUsage,
                      "no worker '" + options.worker + "' is connected; 'legopt status' lists numbers and names");
  }
  if (found.size() > 1) {
    std::string numbers;
    for (const std::int64_t id : found) numbers += (numbers.empty() ? "" : ", ") + std::to_string(id);
    throw ClientError(ExitCode::kUsage,
                      "'" + options.worker + "' is the name of workers " + numbers + "; give a number");
  }
  legopt_msg::control_request request{};
  request.experiment_id = found.front();
  request.action = EnumNumber(ControlAction::kDrainWorker);
  const auto reply = server.Control(request);
  if (ControlStatus{reply.status} != ControlStatus::kOk) throw ClientError(ExitCode::kUsage, reply.message);
  std::cout << "worker " << found.front() << ": takes no more jobs, finishes the " << reply.num_jobs
            << " it has, and leaves\n";
  if (!reply.message.empty()) std::cerr << "legopt: " << app::Printable(reply.message) << "\n";
  return ExitCode::kOk;
}

}  // namespace

void AddDrainCommand(const app::Command& program, Invocation* invocation) {
  const auto command = program.AddCommand("drain", "Stop a worker after its running jobs");
  const auto options = std::make_shared<DrainOptions>();
  command.AddOption("WORKER", options->worker, "Number or name of the worker, as 'legopt status' shows it").Required();
  AddNetworkOptions(command, &options->network);
  command.WhenChosen([=] { invocation->body = [options] { return Drain(*options); }; });
}

}  // namespace legopt::client

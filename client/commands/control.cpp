#include <unistd.h>

#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/command_line.h"
#include "app/printable.h"
#include "bus/field_check.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/service/experiment_status.h"
#include "db/records.h"
#include "legopt/input/json.h"
#include "legopt/input/text.h"
#include "legopt/types/reply.h"

namespace legopt::client {

// Control of experiments after their submission: pause, resume, retry, edit.

namespace {

struct ControlOptions {
  std::int64_t experiment = 0;
  ControlAction action{};
  std::string reason;
  NetworkOptions network;
};

struct EditOptions {
  std::int64_t experiment = 0;
  std::optional<int> priority;
  std::optional<std::string> name;
  std::vector<std::string> tags;
  std::vector<std::string> removed_tags;
  NetworkOptions network;
};

// Checks the limits of requests.
std::string CheckReason(const std::string& reason) {
  constexpr std::size_t kMostBytes = 1000;
  if (reason.find_first_not_of(" \t\r\n") == std::string::npos) {
    return "is empty; give the reason of the pause, or omit --reason";
  }
  if (!bus::IsText(reason)) return "must be UTF-8";
  if (reason.size() <= kMostBytes) return {};
  return "is " + std::to_string(reason.size()) + " bytes long; at most " + std::to_string(kMostBytes) + " are possible";
}

// Refuses names that the server would change or refuse. `fault` is the error of the stored form.
std::string CheckUserText(const std::string& text, std::string fault) {
  if (fault.empty() && !bus::IsText(text)) fault = "must be UTF-8";
  if (!fault.empty()) return fault;
  const auto unfit = DiagnoseName(text);
  return unfit ? unfit->message + "; " + unfit->fix : "";
}

std::string CheckNewName(const std::string& name) { return CheckUserText(name, db::ValidateName(name)); }
std::string CheckTag(const std::string& tag) { return CheckUserText(tag, db::ValidateTag(tag)); }

// A stored tag may violate the present rules of names; it can still be removed.
std::string CheckRemovedTag(const std::string& tag) {
  const std::string fault = db::ValidateTag(tag);
  return fault.empty() && !bus::IsText(tag) ? "must be UTF-8" : fault;
}

std::string CountedJobs(std::int64_t num_jobs) { return std::to_string(num_jobs) + (num_jobs == 1 ? " job" : " jobs"); }

std::string Done(ControlAction action, std::int64_t num_jobs) {
  switch (action) {
    case ControlAction::kPause:
      return "paused; running jobs finish, no other begins until 'legopt resume'";
    case ControlAction::kPauseNow:
      return "paused, " + CountedJobs(num_jobs) + " re-queued; 'legopt resume' continues it";
    case ControlAction::kResume:
      return "continues";
    case ControlAction::kResumeAnyBuild:
      return "continues, by workers of any build";
    default:
      return CountedJobs(num_jobs) + " queued again";
  }
}

legopt_msg::control_request RequestOf(std::int64_t experiment, ControlAction action, const std::string& text = "") {
  legopt_msg::control_request request{};
  request.experiment_id = experiment;
  request.action = EnumNumber(action);
  request.reason = text;
  return request;
}

// Sends the request and prints `done`, or by default the result of the action.
void Apply(ServerConnection& server, const legopt_msg::control_request& request, const std::string& done = "") {
  const auto reply = server.Control(request);
  if (ControlStatus{reply.status} != ControlStatus::kOk)
    throw ClientError(ExitCode::kUsage, reply.message + "; see 'legopt status'");
  const std::string text = done.empty() ? Done(ControlAction{request.action}, reply.num_jobs) : done;
  std::cout << "experiment " << request.experiment_id << ": " << app::Printable(text) << std::endl;
  if (!reply.message.empty()) std::cerr << "legopt: " << app::Printable(reply.message) << "\n";
}

ExitCode Control(const ControlOptions& options) {
  ServerConnection server(options.network);
  Apply(server, RequestOf(options.experiment, options.action, options.reason));
  return ExitCode::kOk;
}

// The priority is first because it needs the most rights.
ExitCode Edit(const EditOptions& options) {
  const std::int64_t id = options.experiment;
  if (!options.priority && !options.name && options.tags.empty() && options.removed_tags.empty()) {
    throw ClientError(ExitCode::kUsage, "nothing to change; give --name, --tag, --untag or --priority");
  }
  ServerConnection server(options.network);
  if (options.priority) {
    auto request = RequestOf(id, ControlAction::kPriority);
    request.priority = *options.priority;
    Apply(server, request, "priority " + std::to_string(*options.priority));
  }
  if (options.name)
    Apply(server, RequestOf(id, ControlAction::kRename, *options.name), "named '" + *options.name + "'");
  for (const std::string& tag : options.removed_tags) {
    Apply(server, RequestOf(id, ControlAction::kUntag, tag), "tag '" + tag + "' removed");
  }
  for (const std::string& tag : options.tags) {
    Apply(server, RequestOf(id, ControlAction::kTag, tag), "tag '" + tag + "' added");
  }
  return ExitCode::kOk;
}

app::Command AddAction(const app::Command& program, Invocation* invocation, const char* name, const char* help,
                       const std::shared_ptr<ControlOptions>& options) {
  const auto command = program.AddCommand(name, help);
  command.AddOption("ID", options->experiment, "Experiment").Required().Check(app::WholeNumber(1));
  AddNetworkOptions(command, &options->network);
  command.WhenChosen([=] { invocation->body = [options] { return Control(*options); }; });
  return command;
}

std::shared_ptr<ControlOptions> For(ControlAction action) {
  const auto options = std::make_shared<ControlOptions>();
  options->action = action;
  return options;
}

void AddPauseCommand(const app::Command& program, Invocation* invocation) {
  const auto pause = For(ControlAction::kPause);
  const auto command = AddAction(program, invocation, "pause",
                                 "Start no more jobs of an experiment; running jobs finish, or stop with --now", pause);
  command.AddFlagAction(
      "--now", [pause] { pause->action = ControlAction::kPauseNow; },
      "Stop the running jobs as well and re-queue them without using an attempt");
  command.AddOption("--reason", pause->reason, "Reason, shown by 'legopt status'").Check({CheckReason, ""});
}

void AddEditCommand(const app::Command& program, Invocation* invocation) {
  const auto options = std::make_shared<EditOptions>();
  const auto command = program.AddCommand("edit", "Change name, tags or priority of an experiment");
  command.AddOption("ID", options->experiment, "Experiment").Required().Check(app::WholeNumber(1));
  command.AddOption("--name", options->name, "New name, 1 to 200 bytes").Check({CheckNewName, ""});
  command.AddOption("--tag", options->tags, "Add this tag, 1 to 100 bytes without a comma; may be repeated")
      .OneArgumentEach()
      .ValueName("TAG")
      .Check({CheckTag, ""});
  command.AddOption("--untag", options->removed_tags, "Remove this tag; may be repeated")
      .OneArgumentEach()
      .ValueName("TAG")
      .Check({CheckRemovedTag, ""});
  command
      .AddOption("--priority", options->priority,
                 "Start its jobs before those of experiments with smaller numbers (default 0)")
      .Check(app::WholeNumber(-db::kMaxPriority, db::kMaxPriority));
  AddNetworkOptions(command, &options->network);
  command.SetFooter(
      "At least one option is required. All are checked first, then applied one by one: priority, name, removed tags,\n"
      "new tags. If the server refuses one, the earlier ones stay; repeat the command after fixing the cause.");
  command.WhenChosen([=] { invocation->body = [options] { return Edit(*options); }; });
}

}  // namespace

void AddControlCommands(const app::Command& program, Invocation* invocation) {
  AddPauseCommand(program, invocation);
  const auto resume = For(ControlAction::kResume);
  AddAction(program, invocation, "resume", "Continue a paused experiment", resume)
      .AddFlagAction(
          "--any-build", [resume] { resume->action = ControlAction::kResumeAnyBuild; },
          "Allow workers of any build to finish it (tables show it); default: the build that began it");
  const auto retry = For(ControlAction::kRetry);
  AddAction(program, invocation, "retry", "Queue the failed and dead jobs of an experiment again", retry)
      .AddFlagAction(
          "--time-limit", [retry] { retry->action = ControlAction::kRetryTimeLimits; },
          "Also jobs stopped by the wall-time limit, e.g. on a busy machine; their results no longer count");
  AddEditCommand(program, invocation);
}

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

// Deletes an experiment permanently, after confirmation.

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

// Scheduling and naming of experiments: pause, resume, hold, release, priority, retry, rename, tag.

#include <iostream>
#include <memory>
#include <string>

#include "app/checks.h"
#include "app/command_line.h"
#include "app/printable.h"
#include "bus/text.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "db/records.h"
#include "legopt/input/name.h"
#include "legopt/types/reply.h"

namespace legopt::client {
namespace {

constexpr int kMostPriority = 1000;

struct ControlOptions {
  std::int64_t experiment = 0;
  ControlAction action{};
  std::string reason;
  int priority = 0;
  NetworkOptions network;
};

// Checks the size limit of requests.
std::string CheckReason(const std::string& reason) {
  constexpr std::size_t kMostBytes = 1000;
  if (reason.find_first_not_of(" \t\r\n") == std::string::npos) return "is empty; say why the experiment is held";
  if (reason.size() <= kMostBytes) return {};
  return "is " + std::to_string(reason.size()) + " bytes long; at most " + std::to_string(kMostBytes) + " are possible";
}

std::string Done(const ControlOptions& options, std::int64_t num_jobs) {
  const std::string jobs = std::to_string(num_jobs) + (num_jobs == 1 ? " job" : " jobs");
  switch (options.action) {
    case ControlAction::kPause:
      return "paused; running jobs finish, no other begins until 'legopt resume'";
    case ControlAction::kResume:
      return "continues";
    case ControlAction::kResumeAnyBuild:
      return "continues, by workers of any build";
    case ControlAction::kHold:
      return "held, " + jobs + " re-queued; 'legopt release' continues it";
    case ControlAction::kRelease:
      return "released";
    case ControlAction::kPriority:
      return "priority " + std::to_string(options.priority);
    case ControlAction::kRename:
      return "renamed";
    case ControlAction::kTag:
      return "tagged";
    case ControlAction::kUntag:
      return "tagged so no longer";
    case ControlAction::kRetry:
    case ControlAction::kRetryTimeLimits:
    case ControlAction::kDrainWorker:  // used by other commands
    case ControlAction::kDelete:
      break;
  }
  return jobs + " queued again";
}

// Refuses invalid UTF-8 before sending, so that names are not changed silently.
void CheckText(const ControlOptions& options) {
  if (options.action == ControlAction::kHold && !bus::IsText(options.reason)) {
    throw ClientError(ExitCode::kUsage, "TEXT: must be UTF-8; write it in UTF-8");
  }
  const bool name = options.action == ControlAction::kRename;
  if (!name && options.action != ControlAction::kTag && options.action != ControlAction::kUntag) return;
  std::string fault = name ? db::ValidateName(options.reason) : db::ValidateTag(options.reason);
  if (fault.empty() && !bus::IsText(options.reason)) fault = "must be UTF-8";
  const auto unfit = options.action == ControlAction::kUntag ? std::nullopt : DiagnoseName(options.reason);
  if (fault.empty() && unfit) fault = unfit->message + "; " + unfit->fix;
  if (!fault.empty()) throw ClientError(ExitCode::kUsage, (name ? "NAME: " : "TAG: ") + fault);
}

ExitCode Control(const ControlOptions& options) {
  CheckText(options);
  legopt_msg::control_request request{};
  request.experiment_id = options.experiment;
  request.action = static_cast<std::int8_t>(options.action);
  request.priority = options.priority;
  request.reason = options.reason;
  ServerConnection server(options.network);
  const auto reply = server.Control(request);
  if (ControlStatus{reply.status} != ControlStatus::kOk)
    throw ClientError(ExitCode::kUsage, reply.message + "; see 'legopt status'");
  std::cout << "experiment " << options.experiment << ": " << app::Printable(Done(options, reply.num_jobs)) << "\n";
  if (!reply.message.empty()) std::cerr << "legopt: " << app::Printable(reply.message) << "\n";
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

void AddTagCommand(const app::Command& program, Invocation* invocation) {
  const auto tag = For(ControlAction::kTag);
  const auto command =
      AddAction(program, invocation, "tag", "Tag an experiment for lists and filters, or remove a tag", tag);
  const auto given = command.AddOption("TAG", tag->reason, "1 to 100 bytes without a comma");
  const auto remove = [tag](const std::string& text) {
    tag->reason = text;
    tag->action = ControlAction::kUntag;
  };
  command.AddAction("--remove", remove, "Remove this tag").Excludes(given);
}

}  // namespace

void AddControlCommands(const app::Command& program, Invocation* invocation) {
  AddAction(program, invocation, "pause", "Start no more jobs of an experiment; running jobs finish",
            For(ControlAction::kPause));
  const auto resume = For(ControlAction::kResume);
  AddAction(program, invocation, "resume", "Continue a paused experiment", resume)
      .AddFlagAction(
          "--any-build", [resume] { resume->action = ControlAction::kResumeAnyBuild; },
          "Also let workers of any build finish it, which tables then say; else the build that began it does");
  const auto hold = For(ControlAction::kHold);
  AddAction(program, invocation, "hold",
            "Stop an experiment for a reason; running jobs are re-queued without using an attempt", hold)
      .AddOption("REASON", hold->reason, "Reason, shown by 'legopt status'")
      .Required()
      .Check({CheckReason, ""});
  AddAction(program, invocation, "release", "Continue a held experiment", For(ControlAction::kRelease));
  const auto priority = For(ControlAction::kPriority);
  AddAction(program, invocation, "priority", "Start an experiment's jobs before or after other experiments' jobs",
            priority)
      .AddOption("PRIORITY", priority->priority, "Larger numbers start earlier (default 0)")
      .Required()
      .Check(app::WholeNumber(-kMostPriority, kMostPriority));
  const auto retry = For(ControlAction::kRetry);
  AddAction(program, invocation, "retry", "Queue the failed and dead jobs of an experiment again", retry)
      .AddFlagAction(
          "--time-limit", [retry] { retry->action = ControlAction::kRetryTimeLimits; },
          "Also jobs stopped by the wall-time limit, e.g. on a busy machine; their results no longer count");
  const auto rename = For(ControlAction::kRename);
  AddAction(program, invocation, "rename", "Rename an experiment", rename)
      .AddOption("NAME", rename->reason, "1 to 200 bytes")
      .Required();
  AddTagCommand(program, invocation);
}

}  // namespace legopt::client

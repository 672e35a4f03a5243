#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <array>
#include <iostream>
#include <string>

#include "app/arguments.h"
#include "app/data_folder.h"
#include "app/exit_codes.h"
#include "app/log_format.h"
#include "app/program_main.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "db/store_error.h"
#include "legopt/planning/certify/certificate.h"
#include "legopt/types/input_error.h"

namespace legopt::client {
namespace {

constexpr char kProgram[] = "legopt";

// Names that users of git, kubectl, Slurm and shells are used to, and names of earlier versions.
constexpr std::array kSynonyms = std::to_array<app::Synonym>({
    {"ls", "list"},
    {"jobs", "list"},
    {"queue", "list"},
    {"ps", "status"},
    {"info", "status"},
    {"squeue", "status"},
    {"top", "watch"},
    {"follow", "watch"},
    {"progress", "watch"},
    {"wait", "watch"},
    {"stop", "cancel"},
    {"kill", "cancel"},
    {"abort", "cancel"},
    {"scancel", "cancel"},
    {"suspend", "pause"},
    {"hold", "pause --now"},
    {"continue", "resume"},
    {"unpause", "resume"},
    {"release", "resume"},
    {"unhold", "resume"},
    {"rerun", "retry"},
    {"requeue", "retry"},
    {"rename", "edit --name"},
    {"mv", "edit --name"},
    {"tag", "edit --tag"},
    {"label", "edit --tag"},
    {"untag", "edit --untag"},
    {"priority", "edit --priority"},
    {"nice", "edit --priority"},
    {"start", "run"},
    {"exec", "run"},
    {"sbatch", "submit"},
    {"results", "table"},
    {"summary", "table"},
    {"eval", "evaluate"},
    {"judge", "evaluate"},
    {"sql", "query"},
    {"select", "query"},
    {"cat", "show"},
    {"describe", "show"},
    {"logs", "show --logs"},
    {"log", "show --logs"},
    {"trace", "show --trace"},
    {"history", "show --trace"},
    {"convergence", "show --trace"},
    {"save", "export"},
    {"datasets", "dataset"},
    {"solver", "service check-solver"},
    {"doctor", "service doctor"},
    {"check", "service doctor"},
    {"events", "service events"},
    {"drain", "service drain"},
    {"tap", "service tap"},
    {"listen", "service tap"},
    {"keygen", "service keygen"},
    {"backup", "service backup"},
    {"cp", "service backup"},
    {"restore", "service restore"},
    {"delete", "service delete"},
    {"rm", "service delete"},
    {"remove", "service delete"},
    {"del", "service delete"},
});

int Report(ExitCode code, const std::string& message) { return app::ReportFailure(kProgram, code, message); }

ExitCode CodeOf(const db::StoreError& error) {
  switch (error.code()) {
    case db::StoreErrorCode::kBadQuery:
      return ExitCode::kUsage;
    case db::StoreErrorCode::kInterrupted:
      return ExitCode::kCutShort;
    case db::StoreErrorCode::kNewerSchema:
      return ExitCode::kNewerDatabase;
    case db::StoreErrorCode::kShortage:
      return ExitCode::kMachine;
    default:
      return ExitCode::kDatabaseUnusable;
  }
}

void StartLogging(bool verbose) {
  auto logger = spdlog::stderr_logger_st("legopt");
  logger->set_level(verbose ? spdlog::level::debug : spdlog::level::warn);
  app::FormatPrintably(*logger, "%H:%M:%S.%e %l %v");
  spdlog::set_default_logger(std::move(logger));
}

int Execute(const Invocation& invocation) {
  try {
    const ExitCode code = invocation.body();
    std::cout.flush();
    const bool about_a_file = code == ExitCode::kUsage || code == ExitCode::kDatabaseUnusable;
    if (about_a_file && app::WorkingDirectoryWasRemoved()) return Report(code, "relative paths lead nowhere");
    return static_cast<int>(code);
  } catch (const ClientError& error) {
    return Report(error.code(), error.what());
  } catch (const certify::CertificateMismatch& error) {
    return Report(ExitCode::kCertificateMismatch, error.what());
  } catch (const db::StoreError& error) {
    return Report(CodeOf(error), error.what());
  } catch (...) {
    return app::ReportException(kProgram);
  }
}

void AddServiceCommands(const app::Command& program, Invocation* invocation) {
  const auto service =
      program.AddCommand("service", "Check and operate a deployment: doctor, events, keys, workers, backups");
  service.RequireCommand();
  service.LetOptionsFollowCommands();
  AddDoctorCommand(service, invocation);
  AddEventsCommand(service, invocation);
  AddDrainCommand(service, invocation);
  AddDeleteCommand(service, invocation);
  AddTapCommand(service, invocation);
  AddKeygenCommand(service, invocation);
  AddBackupCommand(service, invocation);
  AddRestoreCommand(service, invocation);
  AddSolverCommand(service, invocation);
}

// A test limits the number of commands.
void AddCommands(const app::Command& program, Invocation* invocation) {
  AddRunCommand(program, invocation);
  AddSubmitCommand(program, invocation);
  AddWatchCommand(program, invocation);
  AddStatusCommand(program, invocation);
  AddListCommand(program, invocation);
  AddShowCommand(program, invocation);
  AddCancelCommand(program, invocation);
  AddControlCommands(program, invocation);
  program.GroupCommands("Experiments");

  AddTableCommand(program, invocation);
  AddCompareCommand(program, invocation);
  AddPlotCommand(program, invocation);
  AddReportCommand(program, invocation);
  AddViewCommand(program, invocation);
  AddServeCommand(program, invocation);
  AddReplayCommand(program, invocation);
  AddQueryCommand(program, invocation);
  AddEvaluateCommand(program, invocation);
  AddExportCommand(program, invocation);
  AddArchiveCommand(program, invocation);
  program.GroupCommands("Results");

  AddImportCommand(program, invocation);
  AddSceneCommand(program, invocation);
  AddGenerateCommand(program, invocation);
  AddCertifyCommand(program, invocation);
  AddDatasetCommand(program, invocation);
  program.GroupCommands("Datasets");

  AddPoolCommand(program, invocation);
  AddServiceCommands(program, invocation);
  program.GroupCommands("Service");

  AddReferenceCommand(program, invocation);
  program.GroupCommands("");
}

std::string DataFolderText() {
  try {
    return app::DataFolder().string();
  } catch (const InputError& error) {
    return error.what();
  }
}

std::string Footer() {
  return "A first look: legopt run quick\nHelp of a command: legopt help COMMAND; its network options: legopt COMMAND "
         "--help-network\n"
         "\nEmbedded suites and datasets (LEGOPT_DATA names another folder):\n  " +
         DataFolderText() + "\n\n" + app::ExitCodeHelp();
}

}  // namespace

int RunCommandLine(int argc, const char* const* argv, const app::BuildFacts& build) {
  app::Program program(kProgram, "Benchmark optimisers for whole-body postures and motions of legged robots");
  Invocation invocation;
  invocation.build = build;
  program.SetVersion("legopt " + build.version, app::BuildReport(build));
  program.RequireCommand();
  program.SetFooter("Exit codes: see 'legopt --help'");  // inherited by the commands
  AddCommands(program, &invocation);
  program.AddFlagThroughout("-v,--verbose", invocation.verbose, "Log to standard error");
  program.SetFooter(Footer());
  if (const auto status = app::ParseCommandLine(program, argc, argv, kSynonyms)) return *status;
  StartLogging(invocation.verbose);
  return Execute(invocation);
}

}  // namespace legopt::client

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cerrno>
#include <exception>
#include <filesystem>
#include <iostream>
#include <new>
#include <string>
#include <system_error>

#include "bus/bus_error.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "db/store_error.h"
#include "legopt/input_error.h"
#include "programs/arguments.h"
#include "programs/data_folder.h"
#include "programs/exit_codes.h"
#include "programs/log_format.h"

namespace legopt::client {
namespace {

constexpr char kProgram[] = "legopt";

// What users of git, kubectl, Slurm and shells type.
constexpr std::array<programs::Synonym, 41> kSynonyms = {{
    {"rm", "delete"},      {"remove", "delete"},    {"del", "delete"},      {"ls", "list"},
    {"jobs", "list"},      {"queue", "list"},       {"ps", "status"},       {"info", "status"},
    {"squeue", "status"},  {"top", "watch"},        {"follow", "watch"},    {"progress", "watch"},
    {"wait", "watch"},     {"stop", "cancel"},      {"kill", "cancel"},     {"abort", "cancel"},
    {"scancel", "cancel"}, {"suspend", "pause"},    {"continue", "resume"}, {"unpause", "resume"},
    {"unhold", "release"}, {"rerun", "retry"},      {"requeue", "retry"},   {"mv", "rename"},
    {"label", "tag"},      {"start", "run"},        {"exec", "run"},        {"sbatch", "submit"},
    {"results", "table"},  {"summary", "table"},    {"eval", "evaluate"},   {"judge", "evaluate"},
    {"sql", "query"},      {"select", "query"},     {"cat", "show"},        {"describe", "show"},
    {"save", "export"},    {"datasets", "dataset"}, {"check", "doctor"},    {"cp", "backup"},
    {"listen", "tap"},
}};

int Report(ExitCode code, const std::string& message) {
  programs::ReportError(kProgram, message);
  return static_cast<int>(code);
}

ExitCode CodeOf(const db::StoreError& error) {
  switch (error.code()) {
    case db::StoreErrorCode::kBadQuery:
      return ExitCode::kUsage;
    case db::StoreErrorCode::kInterrupted:
      return ExitCode::kUnreachable;
    case db::StoreErrorCode::kNewerSchema:
      return ExitCode::kNewerDatabase;
    default:
      return ExitCode::kDatabaseUnusable;
  }
}

ExitCode CodeOf(const bus::BusError& error) {
  switch (error.code()) {
    case bus::BusErrorCode::kInvalidOption:
    case bus::BusErrorCode::kInvalidMessage:  // made of what the user asked for; the error names field and range
      return ExitCode::kUsage;
    default:
      return ExitCode::kNetworkUnusable;
  }
}

// The machine's refusals that no command expects.
int Report(const std::filesystem::filesystem_error& error) {
  std::string place = error.path1().string();
  if (!error.path2().empty()) place += " and " + error.path2().string();
  if (place.empty()) place = "file system";
  return Report(ExitCode::kUsage,
                place + ": " + error.code().message() + "; check the path, its permissions and space");
}

void StartLogging(bool verbose) {
  auto logger = spdlog::stderr_logger_st("legopt");
  logger->set_level(verbose ? spdlog::level::debug : spdlog::level::warn);
  programs::FormatPrintably(*logger, "%H:%M:%S.%e %l %v");
  spdlog::set_default_logger(std::move(logger));
}

int Execute(const Invocation& invocation) {
  try {
    const auto code = static_cast<int>(invocation.body());
    std::cout.flush();
    if (!std::cout) return Report(ExitCode::kUsage, "standard output cannot be written; is the disk full?");
    return code;
  } catch (const ClientError& error) {
    return Report(error.code(), error.what());
  } catch (const InputError& error) {
    programs::ReportError(kProgram, error);
    return static_cast<int>(ExitCode::kUsage);
  } catch (const db::StoreError& error) {
    return Report(CodeOf(error), error.what());
  } catch (const bus::BusError& error) {
    return Report(CodeOf(error), error.what());
  } catch (const std::bad_alloc&) {
    return Report(ExitCode::kMachine, "out of memory; give the command more, or less to do");
  } catch (const std::filesystem::filesystem_error& error) {
    return Report(error);
  } catch (const std::system_error& error) {
    return Report(ExitCode::kMachine, std::string("the system refuses: ") + error.what());
  } catch (const std::exception& error) {
    return Report(ExitCode::kInternal, std::string("internal error: ") + error.what() + "; please report it");
  }
}

void AddCommands(CLI::App& app, Invocation* invocation) {
  AddRunCommand(app, invocation);
  AddSubmitCommand(app, invocation);
  AddWatchCommand(app, invocation);
  AddStatusCommand(app, invocation);
  AddListCommand(app, invocation);
  AddShowCommand(app, invocation);
  AddCancelCommand(app, invocation);
  AddControlCommands(app, invocation);
  AddDeleteCommand(app, invocation);
  AddTableCommand(app, invocation);
  AddQueryCommand(app, invocation);
  AddEvaluateCommand(app, invocation);
  AddExportCommand(app, invocation);
  AddDatasetCommand(app, invocation);
  AddGenerateCommand(app, invocation);
  AddImportCommand(app, invocation);
  AddDoctorCommand(app, invocation);
  AddTapCommand(app, invocation);
  AddKeygenCommand(app, invocation);
  AddBackupCommand(app, invocation);
}

// Shown in the list of commands; the command line itself is read by programs::ParseCommandLine.
void AddHelpCommands(CLI::App& app) {
  auto* help = app.add_subcommand("help", "Show the help of a command: legopt help run");
  help->add_option("COMMAND", "The command; without one, all of them");
  app.add_subcommand("version", "Show the version, as --version does");
}

// --verbose may also stand after the command.
void AddVerboseFlag(CLI::App& app, Invocation* invocation) {
  app.add_flag("-v,--verbose", invocation->verbose, "Tell on standard error what happens");
  for (auto* command : app.get_subcommands({})) AddVerboseFlag(*command, invocation);
}

std::string DataFolderText() {
  try {
    return programs::DataFolder().string();
  } catch (const InputError& error) {
    return error.what();
  }
}

std::string Footer() {
  return "A first look: legopt run quick\n\nEmbedded suites and datasets (LEGOPT_DATA names another folder):\n  " +
         DataFolderText() + "\n\n" + programs::ExitCodeHelp();
}

}  // namespace

int RunCommandLine(int argc, const char* const* argv) {
  CLI::App app("Which optimiser finds feasible, cheap whole-body postures and motions, and how fast?", kProgram);
  Invocation invocation;
  app.set_version_flag("--version", std::string("legopt ") + LEGOPT_VERSION);
  app.require_subcommand(1);
  app.footer("Exit codes: see 'legopt --help'");  // inherited by the commands
  AddCommands(app, &invocation);
  AddHelpCommands(app);
  AddVerboseFlag(app, &invocation);
  app.footer(Footer());
  if (const auto status = programs::ParseCommandLine(app, argc, argv, kSynonyms)) return *status;
  StartLogging(invocation.verbose);
  return Execute(invocation);
}

}  // namespace legopt::client

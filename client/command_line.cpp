#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <iostream>
#include <string>
#include <vector>

#include "bus/bus_error.h"
#include "client/client_error.h"
#include "client/commands.h"
#include "client/exit_codes.h"
#include "db/store_error.h"
#include "legopt/input_error.h"
#include "legopt/nearest_name.h"

namespace legopt::client {
namespace {

int Report(ExitCode code, const std::string& message) {
  std::string line = message;
  for (char& c : line) {
    if (c == '\n') c = ' ';
  }
  std::cout.flush();
  std::cerr << "legopt: error: " << line << std::endl;
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
  return error.code() == bus::BusErrorCode::kInvalidOption ? ExitCode::kUsage : ExitCode::kNetworkUnusable;
}

void StartLogging(bool verbose) {
  auto logger = spdlog::stderr_logger_st("legopt");
  logger->set_level(verbose ? spdlog::level::debug : spdlog::level::warn);
  logger->set_pattern("%H:%M:%S.%e %l %v");
  spdlog::set_default_logger(std::move(logger));
}

int Execute(const Invocation& invocation) {
  try {
    const auto code = static_cast<int>(invocation.body());
    std::cout.flush();
    if (!std::cout) return Report(ExitCode::kInternal, "standard output cannot be written; is the disk full?");
    return code;
  } catch (const ClientError& error) {
    return Report(error.code(), error.what());
  } catch (const InputError& error) {
    return Report(ExitCode::kUsage, error.what());
  } catch (const db::StoreError& error) {
    return Report(CodeOf(error), error.what());
  } catch (const bus::BusError& error) {
    return Report(CodeOf(error), error.what());
  } catch (const std::bad_alloc&) {
    return Report(ExitCode::kInternal, "out of memory");
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

// CLI11 would only say that a command is missing.
std::string UnknownCommand(const CLI::App& app, int argc, const char* const* argv) {
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word.empty() || word[0] == '-') continue;
    std::vector<std::string> names;
    for (const auto* command : app.get_subcommands({})) names.push_back(command->get_name());
    const bool known = std::find(names.begin(), names.end(), word) != names.end();
    return known ? "" : "unknown command '" + word + "'; " + SuggestName(word, names);
  }
  return {};
}

}  // namespace

int RunCommandLine(int argc, const char* const* argv) {
  CLI::App app("Which optimiser finds feasible, cheap whole-body postures and motions, and how fast?", "legopt");
  Invocation invocation;
  app.set_version_flag("--version", std::string("legopt ") + LEGOPT_VERSION);
  app.add_flag("-v,--verbose", invocation.verbose, "Tell on standard error what happens");
  app.require_subcommand(1);
  app.fallthrough();                              // --verbose may also stand after the command
  app.footer("Exit codes: see 'legopt --help'");  // inherited by the commands
  AddCommands(app, &invocation);
  app.footer(std::string("A first look: legopt run quick\n\n") + kExitCodeHelp);
  if (const std::string fault = UnknownCommand(app, argc, argv); !fault.empty()) return Report(ExitCode::kUsage, fault);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& success) {  // --help, --version
    app.exit(success);
    return static_cast<int>(ExitCode::kOk);
  } catch (const CLI::ParseError& error) {
    return Report(ExitCode::kUsage, std::string(error.what()) + "; see 'legopt --help'");
  }
  StartLogging(invocation.verbose);
  return Execute(invocation);
}

}  // namespace legopt::client

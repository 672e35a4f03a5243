#pragma once

#include <functional>

#include "client/client_error.h"

namespace CLI {
class App;
}

namespace legopt::client {

/// The command that was chosen. Parsing only fills it in; `main` runs it, so that help and usage errors never start
/// anything.
struct Invocation {
  bool verbose = false;
  std::function<ExitCode()> body;
};

// Each adds one subcommand to `app`. `invocation` must outlive the parse.
void AddRunCommand(CLI::App& app, Invocation* invocation);
void AddSubmitCommand(CLI::App& app, Invocation* invocation);
void AddWatchCommand(CLI::App& app, Invocation* invocation);
void AddStatusCommand(CLI::App& app, Invocation* invocation);
void AddListCommand(CLI::App& app, Invocation* invocation);
void AddShowCommand(CLI::App& app, Invocation* invocation);
void AddCancelCommand(CLI::App& app, Invocation* invocation);
void AddDeleteCommand(CLI::App& app, Invocation* invocation);
/// pause, resume, hold, release, priority, retry, rename, tag.
void AddControlCommands(CLI::App& app, Invocation* invocation);
void AddTableCommand(CLI::App& app, Invocation* invocation);
void AddQueryCommand(CLI::App& app, Invocation* invocation);
void AddEvaluateCommand(CLI::App& app, Invocation* invocation);
void AddExportCommand(CLI::App& app, Invocation* invocation);
void AddDatasetCommand(CLI::App& app, Invocation* invocation);
void AddGenerateCommand(CLI::App& app, Invocation* invocation);
void AddImportCommand(CLI::App& app, Invocation* invocation);
void AddDoctorCommand(CLI::App& app, Invocation* invocation);
void AddBackupCommand(CLI::App& app, Invocation* invocation);
void AddTapCommand(CLI::App& app, Invocation* invocation);
void AddKeygenCommand(CLI::App& app, Invocation* invocation);

/// Parses and runs a whole command line, reports errors on standard error as "legopt: error: ..." and returns the exit
/// status. This is `main`, callable from tests.
int RunCommandLine(int argc, const char* const* argv);

}  // namespace legopt::client

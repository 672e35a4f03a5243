#pragma once

#include <functional>

#include "client/client_error.h"
#include "app/build_identity.h"
#include "app/command_line.h"

namespace legopt::client {

/// The selected command. Parsing only sets it and `main` runs it, so that help and usage errors have no side effects.
struct Invocation {
  bool verbose = false;
  programs::BuildFacts build;
  std::function<ExitCode()> body;
};

// Each function adds one command to `program`. `invocation` must outlive parsing.
void AddRunCommand(const programs::Command& program, Invocation* invocation);
void AddSubmitCommand(const programs::Command& program, Invocation* invocation);
void AddWatchCommand(const programs::Command& program, Invocation* invocation);
void AddStatusCommand(const programs::Command& program, Invocation* invocation);
void AddListCommand(const programs::Command& program, Invocation* invocation);
void AddShowCommand(const programs::Command& program, Invocation* invocation);
void AddTraceCommand(const programs::Command& program, Invocation* invocation);
void AddCancelCommand(const programs::Command& program, Invocation* invocation);
void AddDeleteCommand(const programs::Command& program, Invocation* invocation);
/// Adds pause, resume, hold, release, priority, retry, rename, tag.
void AddControlCommands(const programs::Command& program, Invocation* invocation);
void AddTableCommand(const programs::Command& program, Invocation* invocation);
void AddCompareCommand(const programs::Command& program, Invocation* invocation);
void AddReplayCommand(const programs::Command& program, Invocation* invocation);
void AddReportCommand(const programs::Command& program, Invocation* invocation);
void AddViewCommand(const programs::Command& program, Invocation* invocation);
void AddEventsCommand(const programs::Command& program, Invocation* invocation);
void AddDrainCommand(const programs::Command& program, Invocation* invocation);
void AddServeCommand(const programs::Command& program, Invocation* invocation);
void AddLogsCommand(const programs::Command& program, Invocation* invocation);
void AddQueryCommand(const programs::Command& program, Invocation* invocation);
void AddEvaluateCommand(const programs::Command& program, Invocation* invocation);
void AddExportCommand(const programs::Command& program, Invocation* invocation);
void AddDatasetCommand(const programs::Command& program, Invocation* invocation);
void AddCertifyCommand(const programs::Command& program, Invocation* invocation);
void AddGenerateCommand(const programs::Command& program, Invocation* invocation);
void AddSolverCommand(const programs::Command& program, Invocation* invocation);
void AddImportCommand(const programs::Command& program, Invocation* invocation);
void AddDoctorCommand(const programs::Command& program, Invocation* invocation);
void AddBackupCommand(const programs::Command& program, Invocation* invocation);
void AddRestoreCommand(const programs::Command& program, Invocation* invocation);
void AddTapCommand(const programs::Command& program, Invocation* invocation);
/// Adds pool slurm, script, status, stop.
void AddPoolCommand(const programs::Command& program, Invocation* invocation);
void AddKeygenCommand(const programs::Command& program, Invocation* invocation);

/// Parses and runs a command line, reports errors on standard error as "legopt: error: ..." and returns the exit
/// status. `main` as a function, for tests.
int RunCommandLine(int argc, const char* const* argv, const programs::BuildFacts& build);

}  // namespace legopt::client

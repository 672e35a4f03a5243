#pragma once

#include <functional>

#include "app/build_identity.h"
#include "app/command_line.h"
#include "client/client_error.h"

namespace legopt::client {

/// The selected command. Parsing only sets it and `main` runs it, so that help and usage errors have no side effects.
struct Invocation {
  bool verbose = false;
  app::BuildFacts build;
  std::function<ExitCode()> body;
};

// Each function adds one command to `program`. `invocation` must outlive parsing.
void AddRunCommand(const app::Command& program, Invocation* invocation);
void AddSubmitCommand(const app::Command& program, Invocation* invocation);
void AddWatchCommand(const app::Command& program, Invocation* invocation);
void AddStatusCommand(const app::Command& program, Invocation* invocation);
void AddListCommand(const app::Command& program, Invocation* invocation);
void AddShowCommand(const app::Command& program, Invocation* invocation);
void AddCancelCommand(const app::Command& program, Invocation* invocation);
void AddDeleteCommand(const app::Command& program, Invocation* invocation);
/// Adds pause, resume, retry, edit.
void AddControlCommands(const app::Command& program, Invocation* invocation);
void AddArchiveCommand(const app::Command& program, Invocation* invocation);
void AddPlotCommand(const app::Command& program, Invocation* invocation);
void AddTableCommand(const app::Command& program, Invocation* invocation);
void AddCompareCommand(const app::Command& program, Invocation* invocation);
void AddReplayCommand(const app::Command& program, Invocation* invocation);
void AddReportCommand(const app::Command& program, Invocation* invocation);
void AddViewCommand(const app::Command& program, Invocation* invocation);
void AddEventsCommand(const app::Command& program, Invocation* invocation);
void AddDrainCommand(const app::Command& program, Invocation* invocation);
void AddServeCommand(const app::Command& program, Invocation* invocation);
void AddQueryCommand(const app::Command& program, Invocation* invocation);
void AddEvaluateCommand(const app::Command& program, Invocation* invocation);
void AddExportCommand(const app::Command& program, Invocation* invocation);
void AddDatasetCommand(const app::Command& program, Invocation* invocation);
void AddCertifyCommand(const app::Command& program, Invocation* invocation);
void AddGenerateCommand(const app::Command& program, Invocation* invocation);
/// Adds check-solver.
void AddSolverCommand(const app::Command& program, Invocation* invocation);
void AddImportCommand(const app::Command& program, Invocation* invocation);
/// Adds scene repair.
void AddSceneCommand(const app::Command& program, Invocation* invocation);
void AddDoctorCommand(const app::Command& program, Invocation* invocation);
void AddBackupCommand(const app::Command& program, Invocation* invocation);
void AddRestoreCommand(const app::Command& program, Invocation* invocation);
void AddTapCommand(const app::Command& program, Invocation* invocation);
/// Adds pool slurm, script, status, stop.
void AddPoolCommand(const app::Command& program, Invocation* invocation);
void AddKeygenCommand(const app::Command& program, Invocation* invocation);

/// Adds the hidden command that scripts/make-reference calls.
void AddReferenceCommand(const app::Command& program, Invocation* invocation);

/// Parses and runs a command line, reports errors on standard error as "legopt: error: ..." and returns the exit
/// status. `main` as a function, for tests.
int RunCommandLine(int argc, const char* const* argv, const app::BuildFacts& build);

}  // namespace legopt::client

#include "client/service/managed_program.h"

#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <optional>

#include "app/data_folder.h"
#include "client/client_error.h"
#include "legopt/files/file_error.h"
#include "legopt/types/classic_stream.h"

namespace legopt::client {
namespace {

constexpr int kMaxRestarts = 20;

// Returns true for exit codes that name a cause other than a bug or an orderly end.
bool IsSpecificExitCode(int code) {
  const auto named = static_cast<ExitCode>(code);
  if (named == ExitCode::kOk || named == ExitCode::kInterrupted || named == ExitCode::kInternal) return false;
  return std::any_of(app::kExitCodeTexts.begin(), app::kExitCodeTexts.end(),
                     [named](const app::ExitCodeText& known) { return known.code == named; });
}

// Returns the message of a line that reports an error: "[date] [PROGRAM] [error] MESSAGE" or "PROGRAM: error: MESSAGE".
// Messages of other levels may quote such a line.
std::optional<std::string> ErrorIn(const std::string& line, const std::string& program) {
  const std::string logged = " [" + program + "] [error] ";
  const auto date_end = line.find(']');
  if (line.starts_with('[') && date_end != std::string::npos &&
      line.compare(date_end + 1, logged.size(), logged) == 0) {
    return line.substr(date_end + 1 + logged.size());
  }
  const std::string reported = program + ": error: ";
  if (line.starts_with(reported)) return line.substr(reported.size());
  return std::nullopt;
}

// Signals sent by users, batch systems and resource limits are not defects of the program.
ExitCode CodeOfSignal(int signal) {
  switch (signal) {
    case SIGKILL:
    case SIGXCPU:
      return ExitCode::kMachine;
    case SIGTERM:
    case SIGINT:
    case SIGHUP:
    case SIGQUIT:
      return ExitCode::kInterrupted;
    default:
      return ExitCode::kInternal;
  }
}

ExitCode CodeOf(const ChildExit& exit) {
  if (exit.signal != 0) return CodeOfSignal(exit.signal);
  return IsSpecificExitCode(exit.code) ? static_cast<ExitCode>(exit.code) : ExitCode::kInternal;
}

// Throws if the program ended orderly without an order of this process: a user wants the run to end.
void ThrowIfStoppedExternally(const std::string& program, const ChildExit& exit) {
  const bool orderly =
      exit.code == static_cast<int>(ExitCode::kOk) || exit.code == static_cast<int>(ExitCode::kInterrupted);
  if (exit.signal == 0 && orderly) {
    throw ClientError(ExitCode::kInterrupted, program + " of this run was stopped by another program");
  }
}

}  // namespace

std::string LastErrorMessage(const std::string& program, const std::string& tail) {
  std::string words;
  ClassicInput lines(tail);
  for (std::string line; std::getline(lines, line);) {
    if (const auto error = ErrorIn(line, program)) words = *error;
  }
  return words;
}

void ManagedProgram::Start(std::vector<std::string> arguments, std::span<const int> kept) {
  // Batch systems may send signals to all processes of a job: a server that stopped immediately could not re-queue the
  // jobs that the worker releases.
  arguments.insert(arguments.end(), {"--owner", std::to_string(::getpid())});
  if (verbose_) arguments.emplace_back("--verbose");
  child_ = std::make_unique<ChildProcess>(app::ProgramFolder() / name_, arguments, !verbose_, std::string(), kept);
}

bool ManagedProgram::WasKilled() {
  const auto exit = child_->Poll();
  if (!exit) return false;
  ThrowIfStoppedExternally(name_, *exit);
  if (exit->signal == 0) Fail();
  std::fprintf(stderr, "\nlegopt: warning: %s ended with %s; starting it again\n", name_.c_str(),
               exit->Describe().c_str());
  if (++restarts_ > kMaxRestarts) {
    throw ClientError(CodeOfSignal(exit->signal), name_ + " was killed again and again, at last by " +
                                                      exit->Describe() + "; run with --verbose to see why");
  }
  return true;
}

void ManagedProgram::Fail() {
  const ChildExit exit = child_->Poll().value_or(ChildExit{});
  const ExitCode code = CodeOf(exit);
  const std::string words = LastErrorMessage(name_, child_->ErrorTail());
  if (exit.signal == 0 && !words.empty()) throw ClientError(code, name_ + ": " + words);
  throw ClientError(code, name_ + " ended with " + exit.Describe() +
                              (words.empty() ? "; " + files::WriteAdvice("run again with --verbose to see its log")
                                             : "; it reported: " + words));
}

}  // namespace legopt::client

#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "client/service/child_process.h"

namespace legopt::client {

/// Result of a batch system command.
struct EngineResult {
  std::optional<ChildExit> exit;  ///< nullopt: it timed out and was stopped
  std::string output;             ///< standard output
  std::string words;              ///< standard error

  bool ok() const { return exit && exit->signal == 0 && exit->code == 0; }
};

/// A running batch system command (sbatch, squeue, ssh, ...) with a timeout. The destructor stops it. Thread rule: one
/// thread.
class EngineCommand {
 public:
  /// Starts a program found in PATH. Throws ClientError (kMachine) if it is missing.
  EngineCommand(const std::string& program, const std::vector<std::string>& arguments, std::chrono::seconds patience,
                const std::string& input = {});

  /// Returns nullopt while the command runs. Stops it after the timeout.
  std::optional<EngineResult> Poll();
  /// Blocks until the command ends or times out.
  EngineResult Wait();

 private:
  EngineResult AnswerOf(std::optional<ChildExit> exit) const;

  std::chrono::steady_clock::time_point deadline_;
  ChildProcess child_;
};

/// Throws ClientError (kMachine) if PATH does not have the program, with its name and the software that it belongs to.
void RequireEngineProgram(const std::string& program);

}  // namespace legopt::client

#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "client/service/child_process.h"

namespace legopt::client {

/// What a command of an engine said.
struct EngineAnswer {
  std::optional<ChildExit> exit;  ///< empty: it did not end in time, and was ended
  std::string output;             ///< on standard output
  std::string words;              ///< on standard error

  bool ok() const { return exit && exit->signal == 0 && exit->code == 0; }
};

/// A command of an engine (sbatch, squeue, ssh, ...), with a time after which nobody waits for it any longer. The
/// destructor ends it. Thread rule: one thread.
class EngineCall {
 public:
  /// Starts the program of PATH. Throws ClientError (kMachine) when there is none.
  EngineCall(const std::string& program, const std::vector<std::string>& arguments, std::chrono::seconds patience,
             const std::string& input = {});

  /// Empty while it runs. Ends it when its time is over.
  std::optional<EngineAnswer> Poll();
  /// Blocks until it ends or its time is over.
  EngineAnswer Wait();

 private:
  EngineAnswer AnswerOf(std::optional<ChildExit> exit) const;

  std::chrono::steady_clock::time_point deadline_;
  ChildProcess child_;
};

/// Throws ClientError (kMachine) naming the program when PATH has none, and what it belongs to.
void RequireEngineProgram(const std::string& program);

}  // namespace legopt::client

#pragma once

#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "client/service/child_process.h"

namespace legopt::client {

/// Returns the last error message that a child reported on its error output: a line "[...] [PROGRAM] [error] MESSAGE"
/// or "PROGRAM: error: MESSAGE". Empty if there is none; warnings are ignored.
std::string LastErrorMessage(const std::string& program, const std::string& tail);

/// A legopt program in the same folder that runs as part of this command. Only this process can order it to stop. It is
/// restarted if a signal killed it; exiting by itself is an error. Thread rule: one thread.
class ManagedProgram {
 public:
  /// `name`: e.g. "legopt-server". `verbose`: it writes to this process's standard error. Starts nothing.
  ManagedProgram(std::string name, bool verbose) : name_(std::move(name)), verbose_(verbose) {}

  /// Starts or restarts the program; it inherits the descriptors in `kept`. Throws ClientError (kMachine) if the
  /// program is missing.
  void Start(std::vector<std::string> arguments, std::span<const int> kept = {});
  /// True if it has been started and not been dropped.
  bool started() const { return child_ != nullptr; }
  /// Must have been started.
  ChildProcess& child() { return *child_; }
  /// Kills it if it still runs.
  void Drop() { child_.reset(); }

  /// Returns true if a signal has killed it, after a warning on standard error: the caller must restart it. Throws
  /// ClientError if it gave up (with its exit code and last error), ended orderly because another process ordered it to
  /// (kInterrupted), or was killed too often. Must have been started.
  bool WasKilled();
  /// Throws the error that explains its end. It must have ended.
  [[noreturn]] void Fail();

 private:
  std::string name_;
  bool verbose_;
  int restarts_ = 0;
  std::unique_ptr<ChildProcess> child_;
};

}  // namespace legopt::client

#pragma once

#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "client/service/child_process.h"

namespace legopt::client {

/// The last error that a child reported on its error output: a line "[...] [PROGRAM] [error] MESSAGE" or
/// "PROGRAM: error: MESSAGE"; only the message. Empty if there is none: warnings are no cause.
std::string LastWords(const std::string& program, const std::string& tail);

/// A program of legopt beside this one that is a part of a command: it obeys nobody but us, one that a signal killed is
/// to be started again, one that gave up by itself is an error. Thread rule: one thread.
class OwnProgram {
 public:
  /// `name`: "legopt-server". `verbose`: it writes to our standard error. Starts nothing.
  OwnProgram(std::string name, bool verbose) : name_(std::move(name)), verbose_(verbose) {}

  /// Starts it, anew if need be; it inherits the descriptors in `kept`. Throws ClientError (kMachine) when there is no
  /// such program.
  void Start(std::vector<std::string> arguments, std::span<const int> kept = {});
  /// It has been started, and not been dropped.
  bool started() const { return child_ != nullptr; }
  /// Must have been started.
  ChildProcess& child() { return *child_; }
  /// Stops it without grace if it still runs.
  void Drop() { child_.reset(); }

  /// A signal has killed it: the caller is to start it again; said on standard error. Throws ClientError when it gave
  /// up (its exit code and last words), ended in good order because somebody else told it to (kInterrupted), or was
  /// killed too often. Must have been started.
  bool WasKilled();
  /// Throws what its end means. It must have ended.
  [[noreturn]] void Fail();

 private:
  std::string name_;
  bool verbose_;
  int restarts_ = 0;
  std::unique_ptr<ChildProcess> child_;
};

}  // namespace legopt::client

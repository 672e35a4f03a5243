#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/processes.h"

namespace legopt::client {

/// Exit status of a child process.
struct ChildExit {
  int code = 0;    ///< exit status, if `signal` is 0
  int signal = 0;  ///< signal that killed it
  /// Returns "exit code 7" or "signal 11, SIGSEGV (segmentation fault)".
  std::string Describe() const;
};

/// Descriptors used by a child as its standard streams; the caller keeps ownership.
struct ChildFiles {
  int input;   ///< standard input
  int output;  ///< standard output and error
};

/// A child process that never outlives this one: the kernel sends it SIGTERM when this process dies, and the destructor
/// stops it. It has its own process group, so that Ctrl-C reaches only this process, which determines the order of the
/// shutdown. `input` becomes its standard input; its standard output is captured; its standard error goes to this
/// process's standard error, or into memory (see ErrorTail) if `quiet`. Thread rule: the thread that starts it must
/// outlive it.
class ChildProcess {
 public:
  /// Throws ClientError (kInternal) if the program cannot be started. The child inherits the descriptors in `kept`,
  /// each at least 3, with the same numbers.
  ChildProcess(const std::filesystem::path& program, const std::vector<std::string>& arguments, bool quiet,
               const std::string& input = {}, std::span<const int> kept = {});
  /// Starts the child with these files; output() and ErrorTail() stay empty.
  ChildProcess(const std::filesystem::path& program, const std::vector<std::string>& arguments,
               const ChildFiles& files);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  pid_t pid() const { return pid_; }

  /// Returns nullopt while the child runs. Also reads its standard output.
  std::optional<ChildExit> Poll();

  /// Waits for a line of standard output that contains `word`. Returns false if the child ends, `timeout` passes, or
  /// `give_up` (polled regularly) returns true first.
  bool WaitForLine(const std::string& word, std::chrono::milliseconds timeout, bool (*give_up)() = nullptr);

  /// Waits for the end; nullopt if the child still runs after `timeout` or if `give_up` returns true.
  std::optional<ChildExit> Wait(std::chrono::milliseconds timeout, bool (*give_up)() = nullptr);

  /// Sends a signal if the child still runs.
  void Signal(int number);

  /// Sends SIGTERM, and SIGKILL if the child does not end within `grace` or `give_up` returns true. Returns its exit
  /// status.
  ChildExit Stop(std::chrono::milliseconds grace, bool (*give_up)() = nullptr);

  /// Last MiB of its standard output.
  const std::string& output() const { return output_; }

  /// Last lines of its standard error, for a report; empty if it was not quiet.
  std::string ErrorTail() const;

 private:
  void Start(const std::filesystem::path& program, const std::vector<std::string>& arguments, const ChildFiles& files,
             int error, std::span<const int> kept);
  void DrainOutput();

  pid_t pid_ = -1;
  app::Descriptor output_pipe_;
  app::Descriptor error_;  // memfd
  std::string output_;
  std::optional<ChildExit> exit_;
};

}  // namespace legopt::client

#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "programs/processes.h"

namespace legopt::client {

/// How a child ended.
struct ChildExit {
  int code = 0;    ///< exit status, when `signal` is 0
  int signal = 0;  ///< the signal that killed it
  /// "exit code 7" or "signal 11, SIGSEGV (segmentation fault)".
  std::string Describe() const;
};

/// Descriptors that a child is given in place of ours; they stay the caller's.
struct ChildFiles {
  int input;   ///< its standard input
  int output;  ///< its standard output and error
};

/// A program that runs beside us and never outlives us: the kernel sends it SIGTERM when we die, and the destructor
/// stops it. It stands in a process group of its own, so that Ctrl-C reaches only us and we decide the order of the
/// end. Its standard input is `input`; its standard output comes to us; its standard error goes to ours, or into memory
/// when `quiet`, where ErrorTail() finds it. Thread rule: the thread that starts it must live as long as it does.
class ChildProcess {
 public:
  /// Throws ClientError (kInternal) when the program cannot be started.
  /// It inherits the descriptors in `kept`, each at least 3, under their numbers.
  ChildProcess(const std::filesystem::path& program, const std::vector<std::string>& arguments, bool quiet,
               const std::string& input = {}, std::span<const int> kept = {});
  /// As above, but with these files: output() and ErrorTail() stay empty.
  ChildProcess(const std::filesystem::path& program, const std::vector<std::string>& arguments,
               const ChildFiles& files);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  pid_t pid() const { return pid_; }

  /// Empty while the child runs. Also keeps its standard output flowing.
  std::optional<ChildExit> Poll();

  /// Waits for a line of standard output that contains `word`. False when the child ended, `timeout` passed, or
  /// `give_up` (asked now and then) said so first.
  bool WaitForLine(const std::string& word, std::chrono::milliseconds timeout, bool (*give_up)() = nullptr);

  /// Waits for the end; empty when it is still running after `timeout` or `give_up` said so.
  std::optional<ChildExit> Wait(std::chrono::milliseconds timeout, bool (*give_up)() = nullptr);

  /// Sends a signal, if the child still runs.
  void Signal(int number);

  /// SIGTERM, and SIGKILL when that did not end it within `grace` or `give_up` said so. Returns how it ended.
  ChildExit Stop(std::chrono::milliseconds grace, bool (*give_up)() = nullptr);

  /// The last MiB of what it wrote to standard output.
  const std::string& output() const { return output_; }

  /// The last lines it wrote to standard error, for a report; empty when it was not quiet.
  std::string ErrorTail() const;

 private:
  void Start(const std::filesystem::path& program, const std::vector<std::string>& arguments, const ChildFiles& files,
             int error, std::span<const int> kept);
  void DrainOutput();

  pid_t pid_ = -1;
  programs::Descriptor output_pipe_;
  programs::Descriptor error_;  // memory
  std::string output_;
  std::optional<ChildExit> exit_;
};

}  // namespace legopt::client

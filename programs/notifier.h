#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <deque>
#include <string>
#include <vector>

#include "programs/processes.h"

namespace legopt::programs {

/// How often a Notifier starts its command.
struct NotifierLimits {
  std::chrono::milliseconds pause{1'000};     ///< least time between two starts
  std::chrono::milliseconds longest{30'000};  ///< a command that runs for longer is killed
  std::size_t most_waiting = 100;             ///< texts; more are dropped, and counted
};

/// Hands texts to a command, one process each, one at a time: the text is its standard input. Never waits: texts wait
/// until the command before has ended. No shell takes part.
///
/// Thread rule: one thread. It must not wait for children by itself.
class Notifier {
 public:
  using Clock = std::chrono::steady_clock;

  /// `command`: a program and its arguments, with spaces between; a file of that whole name is the program. Throws
  /// InputError when the program does not exist.
  explicit Notifier(const std::string& command, NotifierLimits limits = {});
  /// Kills a command that still runs.
  ~Notifier();
  Notifier(const Notifier&) = delete;
  Notifier& operator=(const Notifier&) = delete;

  /// At most 4 KiB of the text are delivered.
  void Add(std::string text);
  /// Starts, feeds and reaps; to be called now and then. Returns what went wrong, for a log; empty: nothing.
  std::string Work(Clock::time_point now = Clock::now());

  bool idle() const { return pid_ < 0 && waiting_.empty(); }
  std::size_t dropped() const { return dropped_; }  ///< since the start

 private:
  std::string Start(Clock::time_point now);
  std::string Reap(Clock::time_point now);

  std::vector<std::string> command_;  ///< the program's absolute path first
  NotifierLimits limits_;
  std::deque<std::string> waiting_;
  std::size_t dropped_ = 0, dropped_reported_ = 0;
  pid_t pid_ = -1;
  Clock::time_point started_{};
  bool started_before_ = false;
};

}  // namespace legopt::programs

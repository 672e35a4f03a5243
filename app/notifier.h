#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <deque>
#include <string>
#include <vector>

#include "app/processes.h"

namespace legopt::app {

/// Limits of a Notifier.
struct NotifierLimits {
  std::chrono::milliseconds pause{1'000};     ///< minimum time between two starts
  std::chrono::milliseconds longest{30'000};  ///< longest run of a command; then it is killed
  std::size_t most_waiting = 100;             ///< maximum number of queued texts; further ones are dropped and counted
};

/// Passes texts to a command as its standard input, one process per text, one at a time. Never blocks: texts are queued
/// until the previous command has ended. Uses no shell.
///
/// Thread rule: one thread, which must not wait for arbitrary child processes.
class Notifier {
 public:
  using Clock = std::chrono::steady_clock;

  /// `command`: a program and its arguments, separated by spaces; if a file with the whole name exists, it is the
  /// program. Throws InputError if the program does not exist.
  explicit Notifier(const std::string& command, NotifierLimits limits = {});
  /// Kills a running command.
  ~Notifier();
  Notifier(const Notifier&) = delete;
  Notifier& operator=(const Notifier&) = delete;

  /// Queues a text; at most 4 KiB of it are delivered.
  void Add(std::string text);
  /// Starts commands, writes their input and reaps them; must be called regularly. Returns an error for the log; empty:
  /// none.
  std::string Work(Clock::time_point now = Clock::now());

  bool idle() const { return pid_ < 0 && waiting_.empty(); }
  std::size_t dropped() const { return dropped_; }  ///< number of texts dropped since the start

 private:
  std::string Start(Clock::time_point now);
  std::string Reap(Clock::time_point now);

  std::vector<std::string> command_;  ///< begins with the program's absolute path
  NotifierLimits limits_;
  std::deque<std::string> waiting_;
  std::size_t dropped_ = 0, dropped_reported_ = 0;
  pid_t pid_ = -1;
  Clock::time_point started_{};
  bool started_before_ = false;
};

}  // namespace legopt::app

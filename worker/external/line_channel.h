#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace legopt::external {

/// Violation of the protocol by an external solver. It costs an attempt of the job, and what() is the reason shown to
/// users: a sentence without a subject, e.g. "sent nothing for 10 s". Callers that know the solver's name prepend it.
class SolverFault : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Longest line in either direction, without its end.
inline constexpr std::size_t kMaxLineBytes = std::size_t{16} << 20;

/// Lines of text to and from one external solver. One thread.
class LineChannel {
 public:
  using Clock = std::chrono::steady_clock;

  virtual ~LineChannel() = default;

  /// Sends `line` and its end. Throws SolverFault if that is not possible before `deadline`, or if the line is too
  /// long.
  virtual void Send(std::string_view line, Clock::time_point deadline) = 0;

  /// Returns the next line without its end, or nothing if there is none before `deadline`. Throws SolverFault if the
  /// solver has ended or the line is too long.
  virtual std::optional<std::string> Receive(Clock::time_point deadline) = 0;
};

}  // namespace legopt::external

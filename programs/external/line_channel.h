#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace legopt::external {

/// What a solver of others did that it must not: it costs the attempt of a job, and this is the reason that people
/// read. A sentence without its subject, e.g. "sent nothing for 10 s"; whoever knows the solver's name puts it before.
class SolverFault : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The longest line, in either direction and without its end.
inline constexpr std::size_t kMaxLineBytes = std::size_t{16} << 20;

/// Lines of text to and from one solver of others. One thread.
class LineChannel {
 public:
  using Clock = std::chrono::steady_clock;

  virtual ~LineChannel() = default;

  /// Sends `line` and its end. Throws SolverFault when that cannot be done before `deadline`, or when the line is too
  /// long.
  virtual void Send(std::string_view line, Clock::time_point deadline) = 0;

  /// The next line without its end; nothing when there is none before `deadline`. Throws SolverFault when none will
  /// come, as the solver has ended, or when it is too long.
  virtual std::optional<std::string> Receive(Clock::time_point deadline) = 0;
};

}  // namespace legopt::external

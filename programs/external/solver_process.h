#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "programs/external/line_channel.h"
#include "programs/external/solver_launcher.h"

namespace legopt::external {

/// What a solver's standard output is.
enum class Speech {
  kLines,  ///< the protocol's: its end is the solver's, and CPU time counts from the first line, its hello, on
  kLog     ///< for people: CPU time counts from the start
};

/// A solver's process has ended, in whatever way.
class SolverEnded : public SolverFault {
 public:
  SolverEnded(const std::string& reason, const ProcessEnd& end) : SolverFault(reason), end_(end) {}
  const ProcessEnd& end() const { return end_; }  ///< how

 private:
  ProcessEnd end_;
};

/// A solver as a process of its own, from construction to destruction, which ends it with all that it has started.
///
/// What it writes to standard error goes to this process's, which for a job is its log; its last line stands in the
/// fault when the solver ends. Lines are read while one is being sent, so that no two full pipes wait for each other.
class SolverProcess final : public LineChannel {
 public:
  /// Starts command number `command` of the launcher, which must outlive this, and may serve nobody else meanwhile.
  /// Throws SolverFault when the system refuses; `memory_bytes` as of SolverLauncher::Start.
  SolverProcess(SolverLauncher& launcher, std::size_t command, std::int64_t memory_bytes,
                Speech speech = Speech::kLines);
  ~SolverProcess() override;
  SolverProcess(const SolverProcess&) = delete;
  SolverProcess& operator=(const SolverProcess&) = delete;

  void Send(std::string_view line, Clock::time_point deadline) override;
  /// The fault at the solver's end is a SolverEnded.
  std::optional<std::string> Receive(Clock::time_point deadline) override;

 private:
  bool Wait(Clock::time_point deadline, bool to_write);
  bool Write(std::string_view& bytes);
  void ReadOutput();
  void ReadError();
  std::optional<std::string> TakeLine();
  void RequireShort() const;
  [[noreturn]] void ThrowItsEnd();

  SolverLauncher& launcher_;
  SolverLauncher::Streams streams_;
  std::int64_t memory_bytes_;
  Speech speech_;
  std::string output_;       ///< not taken yet
  std::size_t scanned_ = 0;  ///< of it, without an end of line
  bool heard_ = false;       ///< a line of it
  bool ended_ = false;       ///< and all that it wrote is read, whoever else holds its standard output
  std::string last_words_;   ///< the end of what it wrote to standard error
};

}  // namespace legopt::external

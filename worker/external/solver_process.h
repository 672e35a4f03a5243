#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "worker/external/line_channel.h"
#include "worker/external/solver_launcher.h"

namespace legopt::external {

/// Use of a solver's standard output.
enum class OutputKind {
  kLines,  ///< lines of the protocol: its end is the solver's end, and CPU time counts from the first line, its hello
  kLog     ///< log for humans: CPU time counts from the start
};

/// Error: a solver's process has ended.
class SolverEnded : public SolverFault {
 public:
  SolverEnded(const std::string& reason, const ProcessEnd& end) : SolverFault(reason), end_(end) {}
  const ProcessEnd& end() const { return end_; }

 private:
  ProcessEnd end_;
};

/// Process of an external solver, from construction to destruction, which ends it with all its child processes.
///
/// Its standard error goes to this process's, which for a job is the job's log; the last line is part of the fault when
/// the solver ends. Lines are read while one is being sent, so that two full pipes cannot wait for each other.
class SolverProcess final : public LineChannel {
 public:
  /// Starts command number `command` of the launcher. The launcher must outlive this object and must not be used by
  /// another one meanwhile. Throws SolverFault if the system refuses; `memory_bytes`: see SolverLauncher::Start.
  SolverProcess(SolverLauncher& launcher, std::size_t command, std::int64_t memory_bytes,
                OutputKind speech = OutputKind::kLines);
  ~SolverProcess() override;
  SolverProcess(const SolverProcess&) = delete;
  SolverProcess& operator=(const SolverProcess&) = delete;

  void Send(std::string_view line, Clock::time_point deadline) override;
  /// Throws SolverEnded if the solver has ended.
  std::optional<std::string> Receive(Clock::time_point deadline) override;

 private:
  bool Wait(Clock::time_point deadline, bool to_write);
  bool Write(std::string_view& bytes);
  void ReadOutput();
  void ReadError();
  std::optional<std::string> TakeLine();
  void RequireShort() const;
  [[noreturn]] void ThrowSolverEnded();

  SolverLauncher& launcher_;
  SolverLauncher::Streams streams_;
  std::int64_t memory_bytes_;
  OutputKind speech_;
  std::string output_;          ///< output not yet returned as lines
  std::size_t scanned_ = 0;     ///< length of the part of output_ without an end of line
  bool line_received_ = false;  ///< a line was received
  bool ended_ = false;       ///< all its output has been read, even if another process still holds its standard output
  std::string stderr_tail_;  ///< end of its standard error
};

}  // namespace legopt::external

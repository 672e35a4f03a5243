#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "programs/external/line_channel.h"
#include "programs/external/solver_launcher.h"

namespace legopt::external {

/// A solver as a process of its own, from construction to destruction, which ends it with all that it has started.
///
/// What it writes to standard error goes to this process's, which for a job is its log; its last line stands in the
/// fault when the solver ends. Lines are read while one is being sent, so that no two full pipes wait for each other.
class SolverProcess final : public LineChannel {
 public:
  /// Starts command number `command` of the launcher, which must outlive this, and may serve nobody else meanwhile.
  /// Throws SolverFault when the system refuses; `memory_bytes` as of SolverLauncher::Start.
  SolverProcess(SolverLauncher& launcher, std::size_t command, std::int64_t memory_bytes);
  ~SolverProcess() override;
  SolverProcess(const SolverProcess&) = delete;
  SolverProcess& operator=(const SolverProcess&) = delete;

  void Send(std::string_view line, Clock::time_point deadline) override;
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
  std::string output_;       ///< not taken yet
  std::size_t scanned_ = 0;  ///< of it, without an end of line
  bool ended_ = false;       ///< and all that it wrote is read, whoever else holds its standard output
  std::string last_words_;   ///< the end of what it wrote to standard error
};

}  // namespace legopt::external

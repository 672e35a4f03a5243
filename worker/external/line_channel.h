#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "worker/external/solver_launcher.h"

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

/// Creates a folder that only this user can read. Throws std::system_error.
std::filesystem::path MakeScratchFolder();

/// Returns the path of the problem file in that folder.
std::filesystem::path ProblemFile(const std::filesystem::path& scratch);
/// Returns the path of the solution file in that folder.
std::filesystem::path SolutionFile(const std::filesystem::path& scratch);

/// Makes a solver that uses files look like one that uses lines. A `solve` becomes the problem file and a process; its
/// end and the solution file become the `solution`. Any exit code but 0 is a SolverFault. Its output goes to this
/// process's standard error. `cancel` kills it.
class FileChannel final : public LineChannel {
 public:
  /// Starts nothing yet. Requirements on the launcher: see SolverProcess. The command contains the two files of
  /// `scratch`.
  FileChannel(SolverLauncher& launcher, std::size_t command, std::int64_t memory_bytes, const std::string& name,
              std::filesystem::path scratch);

  void Send(std::string_view line, Clock::time_point deadline) override;
  std::optional<std::string> Receive(Clock::time_point deadline) override;

 private:
  void Begin(std::string_view solve);
  std::string Outcome(const SolverEnded& ended) const;

  SolverLauncher& launcher_;
  std::size_t command_;
  std::int64_t memory_bytes_;
  std::filesystem::path scratch_;
  std::unique_ptr<SolverProcess> process_;  ///< process of the current solve
  int num_variables_ = 0;                   ///< number of variables of the current solve
  std::optional<std::string> said_;         ///< line to be received
};

}  // namespace legopt::external

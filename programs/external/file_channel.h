#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "programs/external/line_channel.h"
#include "programs/external/solver_process.h"

namespace legopt::external {

/// A new folder that only this user reads. Throws std::system_error.
std::filesystem::path MakeScratchFolder();

/// What a solver finds in that folder, and what it leaves there.
std::filesystem::path ProblemFile(const std::filesystem::path& scratch);
/// Likewise.
std::filesystem::path SolutionFile(const std::filesystem::path& scratch);

/// A solver that is handed files, as one that speaks lines: a `solve` becomes the problem file and a process, its end
/// and the solution file become the `solution`. Any end but exit code 0 is a SolverFault. What it prints goes to this
/// process's standard error. `cancel` ends it.
class FileChannel final : public LineChannel {
 public:
  /// Starts nothing yet. The launcher, and what it must not do meanwhile, as of SolverProcess; its command names the
  /// two files of `scratch`.
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
  std::unique_ptr<SolverProcess> process_;  ///< of the solve at hand
  int num_variables_ = 0;                   ///< likewise
  std::optional<std::string> said_;         ///< to be received
};

}  // namespace legopt::external

#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "worker/external/line_channel.h"
#include "worker/external/solver_process.h"

namespace legopt::external {

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

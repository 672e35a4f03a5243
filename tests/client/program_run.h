#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "programs/exit_codes.h"

namespace legopt::client {

/// Process ids of the children of `parent` that run the program `name`.
std::vector<int> ChildrenOf(int parent, const std::string& name);

/// The same, once there are some; empty after a minute without. A child that was just made is not yet its program.
std::vector<int> WaitForChildren(int parent, const std::string& name);

/// Blocks until a process that is not our child has ended.
void WaitForEnd(int pid);

inline constexpr int kUsage = static_cast<int>(programs::ExitCode::kUsage);
inline constexpr int kSignalBase = 128;  ///< as shells have it

/// What a program did.
struct ProgramResult {
  int exit_code = -1;  ///< kSignalBase + signal when one killed it
  std::string out;
  std::string err;
};

/// Path of a program of this build; the file need not exist.
std::filesystem::path BuiltProgram(const std::string& name);

/// Runs `legopt ARGUMENTS` in `folder` until it ends. `environment` is added to ours.
ProgramResult RunLegopt(const std::vector<std::string>& arguments, const std::filesystem::path& folder,
                        const std::map<std::string, std::string>& environment = {});

/// A program that runs beside the test; killed at the end if it still runs.
class RunningProgram {
 public:
  RunningProgram(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                 const std::filesystem::path& folder, const std::map<std::string, std::string>& environment = {});
  ~RunningProgram();
  RunningProgram(const RunningProgram&) = delete;
  RunningProgram& operator=(const RunningProgram&) = delete;

  int pid() const { return pid_; }
  /// Blocks until `word` stands in what it wrote to standard error (or it ended). True when it does.
  bool WaitForError(const std::string& word);
  /// Blocks until what it wrote to standard output satisfies `enough` (or it ended). True when it does.
  bool WaitForOutput(const std::function<bool(const std::string&)>& enough);
  /// Blocks until it ends; everything it wrote.
  ProgramResult Wait();

 private:
  bool ReadMore();

  int pid_ = -1;
  int out_fd_ = -1;
  int err_fd_ = -1;
  bool reaped_ = false;
  ProgramResult result_;
};

}  // namespace legopt::client

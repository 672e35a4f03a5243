#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "app/exit_codes.h"

namespace legopt::client {

/// Returns the process ids of the children of `parent` that run the program `name`.
std::vector<int> ChildrenOf(int parent, const std::string& name);

/// Waits until there are such children; empty after a minute without. A newly forked child does not run its program
/// yet.
std::vector<int> WaitForChildren(int parent, const std::string& name);

/// Blocks until a process that is not a child of this one has ended.
void WaitForEnd(int pid);

inline constexpr int kUsage = static_cast<int>(app::ExitCode::kUsage);
inline constexpr int kSignalBase = 128;  ///< exit code of a signal in shells

/// Exit code and output of a program.
struct ProgramResult {
  int exit_code = -1;  ///< kSignalBase + signal if killed by one
  std::string out;
  std::string err;
};

/// Returns the path of a program of this build; the file need not exist.
std::filesystem::path BuiltProgram(const std::string& name);

/// Runs `legopt ARGUMENTS` in `folder` until it ends. `environment` is added to that of this process.
ProgramResult RunLegopt(const std::vector<std::string>& arguments, const std::filesystem::path& folder,
                        const std::map<std::string, std::string>& environment = {});

/// A program that runs in the background; it is killed by the destructor if still running.
class RunningProgram {
 public:
  RunningProgram(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                 const std::filesystem::path& folder, const std::map<std::string, std::string>& environment = {});
  ~RunningProgram();
  RunningProgram(const RunningProgram&) = delete;
  RunningProgram& operator=(const RunningProgram&) = delete;

  int pid() const { return pid_; }
  /// Blocks until standard error contains `word` or the program ended. Returns whether it contains it.
  bool WaitForError(const std::string& word);
  /// Blocks until standard output satisfies `enough` or the program ended. Returns whether it does.
  bool WaitForOutput(const std::function<bool(const std::string&)>& enough);
  /// Blocks until the program ends; returns its whole output.
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

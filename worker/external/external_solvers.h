#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "legopt/solvers/methods/method.h"
#include "legopt/types/experiment.h"
#include "legopt/types/input_error.h"
#include "worker/external/line_channel.h"
#include "worker/external/solver_launcher.h"

namespace legopt::external {

/// Type of communication with an external solver.
enum class ChannelType {
  kLines,  ///< JSON lines over its standard streams, during its whole lifetime
  kFiles   ///< a problem file and the name of a solution file as last arguments; one process per solve
};

/// External solver, declared by a JSON file (docs/reference/external-solvers.md):
///
///     {"name": "slsqp", "command": ["python3", "slsqp.py"], "files": ["../common.py"], "settings": {"ftol": 1e-6},
///      "timeout_s": 60}
///
/// A command without a slash is searched in PATH; another one is relative to the file's folder, where the solver also
/// runs.
struct Declaration {
  std::string file;  ///< path of the declaration
  std::string name;  ///< name used as `solver` in suites
  ChannelType level = ChannelType::kLines;
  std::vector<std::string> command;          ///< argv, as written
  std::filesystem::path folder;              ///< folder of the declaration, absolute
  std::filesystem::path executable;          ///< file of the command's first word, absolute
  std::vector<std::filesystem::path> files;  ///< files of the solver: words of the command, then `files`
  nlohmann::json settings;                   ///< object passed to the solver unchanged
  double timeout_s = 60.0;                   ///< maximum time without output
  std::vector<std::string> environment;      ///< variables passed on in addition to the usual ones
  bool network = false;                      ///< whether the solver needs the network, for example for its licence
  /// BLAKE2b-256 of everything that determines results: command and settings as written, contents of executable and
  /// files. Excludes the location of the files, the time-out, and access to variables and network.
  std::string hash;
};

/// Reads a declaration. Throws one InputError with all faults: file, field, value and fix.
Declaration ReadDeclaration(const std::filesystem::path& file);

/// Reads all declarations. Throws InputError also if two have the same name.
std::vector<Declaration> ReadDeclarations(std::span<const std::filesystem::path> files);

/// Returns the hash for the current contents of the files. Throws InputError if one cannot be read.
std::string CurrentHash(const Declaration& declaration);

/// Error: this machine does not have the solver that a method names. Its declaration or files differ, or it is missing.
class SolverUnavailable : public InputError {
 public:
  using InputError::InputError;
};

/// Starts a declared solver, given its index in the list and its declaration.
using SolverStarter = std::function<std::unique_ptr<LineChannel>(std::size_t number, const Declaration& declaration)>;

/// Returns the registry of the library with the declared solvers added; tables print their names with the suffix
/// "(external)". Methods with such a solver contain the declaration's hash. They are refused with SolverUnavailable if
/// it differs from the hash of this declaration or, when a job starts, of its current files. Without `start` the
/// methods can be described and hashed, but creating a solver throws InputError.
SolverRegistry RegistryWith(std::span<const Declaration> declarations, const SolverStarter& start = {});

/// Declared solvers and their launcher. Must be created before the process forbids itself new processes, and while it
/// is small, because it forks. One thread.
class ExternalSolvers {
 public:
  /// Reads the declarations and starts a launcher if there are any. Throws InputError and std::system_error.
  explicit ExternalSolvers(std::span<const std::filesystem::path> files);
  /// Starts a launcher for declarations that have already been read, if there are any.
  explicit ExternalSolvers(std::vector<Declaration> declarations);
  ~ExternalSolvers();
  ExternalSolvers(const ExternalSolvers&) = delete;
  ExternalSolvers& operator=(const ExternalSolvers&) = delete;

  const std::vector<Declaration>& declarations() const { return declarations_; }

  /// Sets the memory limit of solvers started from now on; 0: none.
  void set_memory_bytes(std::int64_t memory_bytes) { memory_bytes_ = memory_bytes; }

  /// Returns the resources used by the solvers that have ended since the last call; zero if none has run.
  ProcessUsage TakeUsage();

  /// Starts the solver with this index. Throws like SolverProcess.
  std::unique_ptr<LineChannel> Start(std::size_t number);

  /// Returns RegistryWith() for all declarations. This object must outlive the solvers that the registry creates.
  SolverRegistry registry();

 private:
  std::vector<Declaration> declarations_;
  std::filesystem::path scratch_;  ///< folder for solvers that use files; empty: none
  std::unique_ptr<SolverLauncher> launcher_;
  std::int64_t memory_bytes_ = 0;
};

/// Returns RegistryWith() for `declarations`, for processes that are forked. Each process starts its own launcher when
/// it creates its first solver, and the launcher ends with it. Methods may be read and hashed anywhere.
SolverRegistry RegistryForForks(std::span<const Declaration> declarations);

}  // namespace legopt::external

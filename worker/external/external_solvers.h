#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "legopt/solvers/methods/registry.h"
#include "legopt/types/input_error.h"
#include "legopt/types/method_name.h"
#include "worker/external/declaration.h"
#include "worker/external/line_channel.h"
#include "worker/external/solver_launcher.h"

namespace legopt::external {

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

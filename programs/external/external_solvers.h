#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "legopt/input_error.h"
#include "legopt/methods/registry.h"
#include "programs/external/declaration.h"
#include "programs/external/line_channel.h"
#include "programs/external/solver_launcher.h"
#include "words/method_name.h"

namespace legopt::external {

/// This machine does not have the solver that a method names: another declaration, other files, or none.
class SolverUnavailable : public InputError {
 public:
  using InputError::InputError;
};

/// Starts a declared solver: a number of the list and its declaration.
using SolverStarter = std::function<std::unique_ptr<LineChannel>(std::size_t number, const Declaration& declaration)>;

/// The registry of the library with the declared solvers besides; tables print their names with the mark "(external)".
/// Methods of theirs hold the declaration's hash, and are refused with SolverUnavailable where it is another than that
/// of this declaration, or of its files as they are when a job begins. Without `start` they can be described and
/// hashed, not made: that is an InputError.
SolverRegistry RegistryWith(std::span<const Declaration> declarations, const SolverStarter& start = {});

/// Declared solvers, and what starts them. To be made before the process forbids itself new processes, and before it
/// grows: it forks. One thread.
class ExternalSolvers {
 public:
  /// Reads the declarations; starts a launcher if there are any. Throws InputError and std::system_error.
  explicit ExternalSolvers(std::span<const std::filesystem::path> files);
  /// Likewise, of declarations that have been read.
  explicit ExternalSolvers(std::vector<Declaration> declarations);
  ~ExternalSolvers();
  ExternalSolvers(const ExternalSolvers&) = delete;
  ExternalSolvers& operator=(const ExternalSolvers&) = delete;

  const std::vector<Declaration>& declarations() const { return declarations_; }

  /// Limit of what is started from now on; 0: none.
  void set_memory_bytes(std::int64_t memory_bytes) { memory_bytes_ = memory_bytes; }

  /// What the solvers that have ended since the last call have used; nothing where none has run.
  ProcessUsage TakeUsage();

  /// Starts the solver with this number. Throws as SolverProcess.
  std::unique_ptr<LineChannel> Start(std::size_t number);

  /// RegistryWith all of them. This must outlive the solvers that it makes.
  SolverRegistry registry();

 private:
  std::vector<Declaration> declarations_;
  std::filesystem::path scratch_;  ///< of those that are handed files; empty: there is none
  std::unique_ptr<SolverLauncher> launcher_;
  std::int64_t memory_bytes_ = 0;
};

/// RegistryWith `declarations`, whose solvers are started by the process in which they are made, for processes that are
/// forked off: each starts, at its first one, a launcher of its own, which ends with it. Methods may be read and hashed
/// anywhere.
SolverRegistry RegistryForForks(std::span<const Declaration> declarations);

}  // namespace legopt::external

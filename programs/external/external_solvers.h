#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "legopt/methods/registry.h"
#include "programs/external/declaration.h"
#include "programs/external/line_channel.h"

namespace legopt::external {

/// What stands behind the names of methods with such solvers.
inline constexpr char kExternalMark[] = " (external)";

/// Starts a declared solver: a number of the list and its declaration.
using SolverStarter = std::function<std::unique_ptr<LineChannel>(std::size_t number, const Declaration& declaration)>;

/// The registry of the library with the declared solvers besides; tables print their names with the mark "(external)".
/// Methods of theirs hold the declaration's hash, and are refused with an InputError where it is another than that of
/// this declaration, or of its files as they are when a job begins. Without `start` they can be described and hashed,
/// not made: that is an InputError.
SolverRegistry RegistryWith(std::span<const Declaration> declarations, const SolverStarter& start = {});

class SolverLauncher;

/// Declared solvers, and what starts them. To be made before the process forbids itself new processes, and before it
/// grows: it forks. One thread.
class ExternalSolvers {
 public:
  /// Reads the declarations; starts a launcher if there are any. Throws InputError and std::system_error.
  explicit ExternalSolvers(std::span<const std::filesystem::path> files);
  ~ExternalSolvers();
  ExternalSolvers(const ExternalSolvers&) = delete;
  ExternalSolvers& operator=(const ExternalSolvers&) = delete;

  const std::vector<Declaration>& declarations() const { return declarations_; }

  /// Limit of what is started from now on; 0: none.
  void set_memory_bytes(std::int64_t memory_bytes) { memory_bytes_ = memory_bytes; }

  /// Starts the solver with this number. Throws as SolverProcess.
  std::unique_ptr<LineChannel> Start(std::size_t number);

  /// RegistryWith all of them. This must outlive the solvers that it makes.
  SolverRegistry registry();

 private:
  std::vector<Declaration> declarations_;
  std::unique_ptr<SolverLauncher> launcher_;
  std::int64_t memory_bytes_ = 0;
};

}  // namespace legopt::external

#include "programs/external/external_solvers.h"

#include <utility>

#include "legopt/input_error.h"
#include "programs/external/external_options.h"
#include "programs/external/external_solver.h"
#include "programs/external/solver_launcher.h"
#include "programs/external/solver_process.h"

namespace legopt::external {
namespace {

constexpr double kAhead_m = 0.03;  // rows are seen before they are violated

// What is about to run is what the method names, or nothing runs.
void RequireDeclared(const ExternalOptions& options, const Declaration& declaration) {
  const std::string source = "solver '" + declaration.name + "' (external)";
  if (options.declaration != declaration.hash) {
    throw InputError(
        {source, "declaration", options.declaration,
         "the job was submitted with another declaration than " + declaration.file + " of this worker, whose hash is " +
             declaration.hash,
         "start client and workers with --solver and equal files: command, settings, executable, scripts"});
  }
  if (const std::string now = CurrentHash(declaration); now != declaration.hash) {
    throw InputError(
        {source, "declaration", now,
         "a file of the solver has changed since the worker was started, when the hash was " + declaration.hash,
         "start the worker again, and submit again for the changed solver"});
  }
}

std::unique_ptr<Solver> MakeExternal(const ExternalOptions& options, std::size_t number, const Declaration& declaration,
                                     const SolverStarter& start) {
  if (!start) {
    throw InputError({declaration.file, "name", declaration.name, "is not run by this program",
                      "solve with legopt-worker --solver " + declaration.file});
  }
  RequireDeclared(options, declaration);
  ExternalManner manner{declaration.name, declaration.settings, declaration.timeout_s};
  auto solver = std::make_unique<ExternalSolver>(options, std::move(manner),
                                                 [number, declaration, start] { return start(number, declaration); });
  solver->Start();
  return solver;
}

}  // namespace

SolverRegistry RegistryWith(std::span<const Declaration> declarations, const SolverStarter& start) {
  SolverRegistry registry;
  for (std::size_t number = 0; number < declarations.size(); ++number) {
    const Declaration& declaration = declarations[number];
    registry.Register<ExternalOptions>(
        {.word = declaration.name,
         .paper_name = declaration.name + kExternalMark,
         .draws = true,
         .mark = kExternalMark,
         .contact_range_m = kAhead_m},
        [number, declaration, start](const ExternalOptions& options, const Sampling&) {
          return MakeExternal(options, number, declaration, start);
        },
        ExternalOptions{.declaration = declaration.hash});
  }
  return registry;
}

ExternalSolvers::ExternalSolvers(std::span<const std::filesystem::path> files)
    : declarations_(ReadDeclarations(files)) {
  if (declarations_.empty()) return;
  std::vector<LaunchCommand> commands;
  for (const Declaration& declaration : declarations_) {
    commands.push_back({declaration.executable, declaration.command, declaration.folder});
  }
  launcher_ = std::make_unique<SolverLauncher>(commands);
}

ExternalSolvers::~ExternalSolvers() = default;

std::unique_ptr<LineChannel> ExternalSolvers::Start(std::size_t number) {
  return std::make_unique<SolverProcess>(*launcher_, number, memory_bytes_);
}

SolverRegistry ExternalSolvers::registry() {
  return RegistryWith(declarations_, [this](std::size_t number, const Declaration&) { return Start(number); });
}

}  // namespace legopt::external

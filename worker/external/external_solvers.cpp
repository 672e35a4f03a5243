#include "worker/external/external_solvers.h"

#include <algorithm>
#include <utility>

#include "legopt/types/input_error.h"
#include "worker/external/external_options.h"
#include "worker/external/external_solver.h"
#include "worker/external/file_channel.h"
#include "worker/external/solver_process.h"

namespace legopt::external {
namespace {

constexpr double kAhead_m = 0.03;  // distance from which rows appear, before they are violated

// Returns the current hash. Unreadable files are treated as missing.
std::string HashNow(const Declaration& declaration) {
  try {
    return CurrentHash(declaration);
  } catch (const InputError& error) {
    throw SolverUnavailable(error.fault());
  }
}

// Requires that the solver to be run is the one that the method names.
void RequireDeclared(const ExternalOptions& options, const Declaration& declaration) {
  const std::string source = "solver '" + declaration.name + "' (external)";
  if (options.declaration != declaration.hash) {
    throw SolverUnavailable(
        {source, "declaration", options.declaration,
         "the job was submitted with another declaration than " + declaration.file + " of this worker, whose hash is " +
             declaration.hash,
         "start client and workers with --solver and equal files: command, settings, executable, scripts"});
  }
  if (const std::string now = HashNow(declaration); now != declaration.hash) {
    throw SolverUnavailable(
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
  ExternalProtocol manner{declaration.name, declaration.settings, declaration.timeout_s};
  manner.has_no_requests = declaration.level == ChannelType::kFiles;
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
         .is_stochastic = true,
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
    : ExternalSolvers(ReadDeclarations(files)) {}

ExternalSolvers::ExternalSolvers(std::vector<Declaration> declarations) : declarations_(std::move(declarations)) {
  if (declarations_.empty()) return;
  if (std::ranges::find(declarations_, ChannelType::kFiles, &Declaration::level) != declarations_.end()) {
    scratch_ = MakeScratchFolder();
  }
  std::vector<LaunchCommand> commands;
  for (const Declaration& declaration : declarations_) {
    commands.push_back({declaration.executable, declaration.command, declaration.folder, declaration.environment,
                        declaration.network});
    if (declaration.level == ChannelType::kLines) continue;
    for (const auto& file : {ProblemFile(scratch_), SolutionFile(scratch_)}) {
      commands.back().arguments.push_back(file.string());
    }
  }
  launcher_ = std::make_unique<SolverLauncher>(commands, scratch_);
}

ExternalSolvers::~ExternalSolvers() = default;

std::unique_ptr<LineChannel> ExternalSolvers::Start(std::size_t number) {
  const Declaration& declaration = declarations_[number];
  if (declaration.level == ChannelType::kLines)
    return std::make_unique<SolverProcess>(*launcher_, number, memory_bytes_);
  return std::make_unique<FileChannel>(*launcher_, number, memory_bytes_, declaration.name, scratch_);
}

ProcessUsage ExternalSolvers::TakeUsage() { return launcher_ == nullptr ? ProcessUsage() : launcher_->TakeUsage(); }

SolverRegistry ExternalSolvers::registry() {
  return RegistryWith(declarations_, [this](std::size_t number, const Declaration&) { return Start(number); });
}

SolverRegistry RegistryForForks(std::span<const Declaration> declarations) {
  const auto solvers = std::make_shared<std::unique_ptr<ExternalSolvers>>();
  const std::vector<Declaration> all(declarations.begin(), declarations.end());
  return RegistryWith(declarations, [solvers, all](std::size_t number, const Declaration&) {
    if (*solvers == nullptr) *solvers = std::make_unique<ExternalSolvers>(all);
    return (*solvers)->Start(number);
  });
}

}  // namespace legopt::external

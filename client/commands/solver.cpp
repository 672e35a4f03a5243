#include <array>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/command_line.h"
#include "app/folder_cache.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/report/listing.h"
#include "client/suite/input_files.h"
#include "legopt/dataset/dataset.h"
#include "worker/external/external_solvers.h"
#include "worker/external/solver_check.h"

namespace legopt::client {
namespace {

struct SolverFlags {
  std::string declaration;
  std::optional<std::string> dataset;
  TableFormat format = TableFormat::kText;
};

ExitCode CheckDeclared(const SolverFlags& flags) {
  const std::array<std::filesystem::path, 1> files = {InputFile(flags.declaration)};
  external::ExternalSolvers solvers(files);  // before this process grows, because it forks
  const auto dataset = Dataset::Load(ChooseDatasetFolder(flags.dataset, nullptr), GuardedReader());
  Listing listing;
  listing.columns = {"result", "check", "detail"};
  bool passed = true;
  for (const external::SolverDiagnostic& finding : external::CheckSolver(solvers, dataset)) {
    listing.rows.push_back({finding.passed ? "ok" : "FAIL", finding.check, finding.detail});
    passed = passed && finding.passed;
  }
  const external::Declaration& declaration = solvers.declarations().front();
  if (flags.format == TableFormat::kText) {
    std::cout << "solver '" << declaration.name << "', hash " << declaration.hash << "\n\n";
  }
  PrintPlain(listing, flags.format);
  if (passed) return ExitCode::kOk;
  throw ClientError(ExitCode::kJobsFailed, flags.declaration +
                                               ": the solver does not keep to the protocol (marked "
                                               "FAIL); docs/reference/external-solvers.md has it");
}

}  // namespace

void AddSolverCommand(const app::Command& program, Invocation* invocation) {
  const auto check = program.AddCommand("check-solver", "Test whether an external solver follows the protocol");
  const auto flags = std::make_shared<SolverFlags>();
  check
      .AddOption("FILE", flags->declaration,
                 "Declaration of the solver (docs/reference/external-solvers.md), - for standard input")
      .Required();
  check.AddOption("--dataset", flags->dataset, "Dataset folder to try it on (default: the embedded garage-easier)");
  AddFormatOption(check, &flags->format);
  check.WhenChosen([=] { invocation->body = [flags] { return CheckDeclared(*flags); }; });
}

}  // namespace legopt::client

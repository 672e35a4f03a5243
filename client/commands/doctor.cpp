#include <iostream>
#include <memory>

#include "app/command_line.h"
#include "client/commands/commands.h"
#include "client/commands/diagnosis.h"
#include "client/commands/options.h"
#include "client/report/terminal.h"

namespace legopt::client {
namespace {

struct DoctorOptions {
  DiagnosisOptions diagnosis;
  TableFormat format = TableFormat::kText;
};

ExitCode Doctor(const DoctorOptions& options) {
  const auto findings = Diagnose(options.diagnosis);
  const std::string text = RenderFindings(findings, options.format, LayoutOf({}));
  std::cout << (options.format == TableFormat::kCsv ? CsvFor(StandardOutput(), text) : text);
  return WorstOf(findings);
}

}  // namespace

void AddDoctorCommand(const app::Command& program, Invocation* invocation) {
  const auto command =
      program.AddCommand("doctor", "Check network, programs, server, clock, dataset; says what to fix");
  const auto options = std::make_shared<DoctorOptions>();
  AddDatasetOption(command, &options->diagnosis.dataset);
  command.AddOption("--db", options->diagnosis.db,
                    "Also check this database file: integrity, foreign keys, schema and consistency of rows");
  AddFormatOption(command, &options->format);
  AddNetworkOptions(command, &options->diagnosis.network);
  command.WhenChosen([=] {
    options->diagnosis.build = invocation->build;
    invocation->body = [options] { return Doctor(*options); };
  });
}

}  // namespace legopt::client

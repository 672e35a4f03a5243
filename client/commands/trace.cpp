#include <iostream>
#include <memory>
#include <optional>

#include "app/checks.h"
#include "app/command_line.h"
#include "app/printable.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/replay/stored_trace.h"
#include "legopt/dataset/text_file.h"

namespace legopt::client {
namespace {

struct TraceOptions {
  std::int64_t job = 0;
  std::optional<std::string> out;
  SourceOptions source;
  ListingOptions listing;
};

ExitCode Trace(const TraceOptions& options) {
  const StoredTrace trace = ReadTrace(*OpenResults(options.source), options.job);
  const Listing listing = trace.records.empty() ? trace.history : TraceListing(trace.records);
  if (options.out) {
    const Table table = TableOf(listing);
    const Table& kept = options.listing.columns.empty() ? table : KeepColumns(table, options.listing.columns);
    WriteTextFile(*options.out, RenderTable(kept, options.listing.format));
    std::cerr << listing.rows.size() << " records written to " << app::Printable(*options.out) << "\n";
  } else {
    PrintListing(listing, options.listing);
  }
  if (trace.records.empty()) {
    std::cerr << "legopt: this result is older than traces: a row per penalty value, without times and evaluations\n";
  }
  return ExitCode::kOk;
}

}  // namespace

void AddTraceCommand(const app::Command& program, Invocation* invocation) {
  const auto command = program.AddCommand("trace", "Show how the solve of one job converged, step by step");
  const auto options = std::make_shared<TraceOptions>();
  command.AddOption("JOB", options->job, "Job, as 'legopt list' shows it").Required().Check(app::WholeNumber(1));
  command.AddOption("--out", options->out, "Write it to this file instead, replacing an existing one");
  AddListingOptions(command, &options->listing);
  AddSourceOptions(command, &options->source);
  command.WhenChosen([=] { invocation->body = [options] { return Trace(*options); }; });
}

}  // namespace legopt::client

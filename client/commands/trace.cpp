#include <iostream>

#include "app/printable.h"
#include "client/commands/show.h"
#include "client/replay/stored_trace.h"
#include "legopt/dataset/text_file.h"

namespace legopt::client {

ExitCode ShowTrace(const ShowOptions& options) {
  const StoredTrace trace = ReadTrace(*OpenResults(options.source), options.job);
  const Listing listing = trace.records.empty() ? trace.history : TraceListing(trace.records);
  if (options.out) {
    const Table kept = SelectedPart(TableOf(listing), options.listing);
    WriteTextFile(*options.out, RenderTable(kept, options.listing.format));
    std::cerr << kept.rows.size() << " records written to " << app::Printable(*options.out) << "\n";
  } else {
    PrintListing(listing, options.listing);
  }
  if (trace.records.empty()) {
    std::cerr << "legopt: this result is older than traces: a row per penalty value, without times and evaluations\n";
  }
  return ExitCode::kOk;
}

}  // namespace legopt::client

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "client/commands.h"
#include "client/options.h"

namespace legopt::client {
namespace {

constexpr int kDefaultMaxRows = 100'000;

struct Options {
  std::string sql;
  SourceOptions source;
  ListingOptions listing;
  int max_rows = kDefaultMaxRows;
};

ExitCode Query(const Options& options) {
  const Listing listing = OpenResults(options.source)->Query(options.sql, options.max_rows);
  PrintListing(listing, options.listing);
  if (listing.truncated) {
    std::cerr << "legopt: only the first " << listing.rows.size() << " rows are shown; raise --max-rows\n";
  }
  return ExitCode::kOk;
}

}  // namespace

void AddQueryCommand(CLI::App& app, Invocation* invocation) {
  auto* command = app.add_subcommand("query", "Run a read-only SQL statement on the results");
  const auto options = std::make_shared<Options>();
  command->add_option("SQL", options->sql, "One SELECT, e.g. \"SELECT * FROM benchmark_table\"")->required();
  command->add_option("--max-rows", options->max_rows, "Most rows to read (default 100000)")
      ->check(CLI::Range(1, ResultSource::kAllRows));
  AddListingOptions(*command, &options->listing);
  AddSourceOptions(*command, &options->source);
  command->footer(
      "Views: benchmark_table, benchmark_cells, experiment_list, job_list, failures, disagreements, "
      "interpolation_cells");
  command->callback([=] { invocation->body = [options] { return Query(*options); }; });
}

}  // namespace legopt::client

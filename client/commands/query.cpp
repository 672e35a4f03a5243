#include <iostream>
#include <memory>

#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "programs/checks.h"
#include "programs/command_line.h"

namespace legopt::client {
namespace {

constexpr int kDefaultMaxRows = 100'000;

struct QueryOptions {
  std::string sql;
  SourceOptions source;
  ListingOptions listing;
  int max_rows = kDefaultMaxRows;
  double limit_s = ResultSource::kDefaultLimit_s;
};

void RequireStatement(const std::string& sql) {
  constexpr std::size_t kMaxBytes = 99'000;  // SQLite's bound is little more
  if (sql.find_first_not_of(" \t\r\n;") == std::string::npos) {
    throw ClientError(ExitCode::kUsage, "the SQL is empty; give one SELECT, e.g. \"SELECT * FROM benchmark_table\"");
  }
  if (sql.size() > kMaxBytes) {
    throw ClientError(ExitCode::kUsage, "the SQL has " + std::to_string(sql.size()) + " bytes, more than the " +
                                            std::to_string(kMaxBytes) + " that one statement may have");
  }
}

ExitCode Query(const QueryOptions& options) {
  RequireStatement(options.sql);
  if (options.limit_s == 0 && !options.source.db) {
    throw ClientError(ExitCode::kUsage, "--limit 0 (no limit) is for a file, --db; a server runs a query for at most " +
                                            std::to_string(static_cast<int>(ResultSource::kLongestLimit_s)) + " s");
  }
  const Listing listing = OpenResults(options.source)->Query(options.sql, options.max_rows, options.limit_s);
  PrintListing(listing, options.listing);
  if (listing.truncated) {
    std::cerr << "legopt: only the first " << listing.rows.size() << " rows are shown; raise --max-rows\n";
  }
  return ExitCode::kOk;
}

}  // namespace

void AddQueryCommand(const programs::Command& program, Invocation* invocation) {
  const auto command = program.AddCommand("query", "Run a read-only SQL statement on the results");
  const auto options = std::make_shared<QueryOptions>();
  command.AddOption("SQL", options->sql, "One SELECT, e.g. \"SELECT * FROM benchmark_table\"").Required();
  command.AddOption("--max-rows", options->max_rows, "Most rows to read (default 100000)")
      .Check(programs::WholeNumber(1, ResultSource::kAllRows));
  command
      .AddOption("--limit", options->limit_s,
                 "Seconds after which the query is stopped (default 30); 0 with --db: never")
      .Check(programs::Number(0, ResultSource::kLongestLimit_s));
  AddListingOptions(command, &options->listing);
  AddSourceOptions(command, &options->source);
  command.SetFooter(
      "Views: benchmark_table, benchmark_cells, experiment_list, job_list, failures, disagreements, "
      "interpolation_cells");
  command.WhenChosen([=] { invocation->body = [options] { return Query(*options); }; });
}

}  // namespace legopt::client

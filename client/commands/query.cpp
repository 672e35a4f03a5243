#include <iostream>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "app/command_line.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/report/listing.h"
#include "client/report/output.h"
#include "legopt/input/text.h"

namespace legopt::client {
namespace {

constexpr int kDefaultMaxRows = 100'000;

struct QueryOptions {
  std::string sql;
  SourceOptions source;
  ListingOptions listing;
  std::optional<int> max_rows;
  std::optional<double> limit_s;
};

void RequireStatement(const std::string& sql) {
  constexpr std::size_t kMaxBytes = 99'000;  // slightly below SQLite's limit
  if (sql.find_first_not_of(" \t\r\n;") == std::string::npos) {
    throw ClientError(ExitCode::kUsage, "the SQL is empty; give one SELECT, e.g. \"SELECT * FROM benchmark_table\"");
  }
  RequireUtf8(sql, "the SQL");
  if (sql.size() > kMaxBytes) {
    throw ClientError(ExitCode::kUsage, "the SQL has " + std::to_string(sql.size()) + " bytes, more than the " +
                                            std::to_string(kMaxBytes) + " that one statement may have");
  }
}

// Rows of a file are streamed to a pipe or file; all other output is formatted in memory as a whole. So are selected
// rows, because an error for a row that does not exist must come before any output.
bool Streams(const QueryOptions& options) {
  return options.source.db && IsExact(options.listing.format) && options.listing.rows.empty() &&
         !StandardOutput().is_terminal;
}

ExitCode ReportRowLimit(std::int64_t rows) {
  std::cerr << "legopt: cut after " << rows << " rows: --max-rows; raise it\n";
  return ExitCode::kCutShort;
}

// The size is limited for rows in memory and for a server's answer.
ExitCode ReportByteLimit(const QueryOptions& options, std::size_t rows) {
  std::cerr << "legopt: cut after " << rows << " rows: "
            << (options.source.db ? "the 256 MiB that a result may take in memory; write it with --format csv or json "
                                    "into a file or pipe, which has no limit\n"
                                  : "the 48 MiB of a server's answer; ask for fewer rows or columns, or read the "
                                    "file with --db\n");
  return ExitCode::kCutShort;
}

ExitCode StreamRows(const QueryOptions& options, ResultSource& source) {
  ResultSource::StreamLimits limits;
  limits.max_rows = options.max_rows ? *options.max_rows : std::numeric_limits<std::int64_t>::max();
  limits.limit_s = options.limit_s.value_or(ResultSource::kDefaultLimit_s);
  limits.time_is_per_row = !options.limit_s;
  ListingWriter writer(options.listing.format, options.listing.columns);
  return source.Stream(options.sql, limits, writer) ? ReportRowLimit(limits.max_rows) : ExitCode::kOk;
}

ExitCode Query(const QueryOptions& options) {
  RequireStatement(options.sql);
  if (options.limit_s == 0.0 && !options.source.db) {
    throw ClientError(ExitCode::kUsage, "--limit 0 (no limit) is for a file, --db; a server runs a query for at most " +
                                            std::to_string(static_cast<int>(ResultSource::kLongestLimit_s)) + " s");
  }
  const auto source = OpenResults(options.source);
  if (Streams(options)) return StreamRows(options, *source);
  const int max_rows = options.max_rows.value_or(kDefaultMaxRows);
  const Listing listing = source->Query(options.sql, max_rows, options.limit_s.value_or(ResultSource::kDefaultLimit_s));
  PrintListing(listing, options.listing);
  if (!listing.truncated) return ExitCode::kOk;
  const std::size_t rows = listing.rows.size();
  return std::cmp_greater_equal(rows, max_rows) ? ReportRowLimit(max_rows) : ReportByteLimit(options, rows);
}

}  // namespace

void AddQueryCommand(const app::Command& program, Invocation* invocation) {
  const auto command = program.AddCommand("query", "Run a read-only SQL statement on the results");
  const auto options = std::make_shared<QueryOptions>();
  command.AddOption("SQL", options->sql, "One SELECT, e.g. \"SELECT * FROM benchmark_table\"").Required();
  command
      .AddOption("--max-rows", options->max_rows,
                 "Maximum number of rows (default 100000; CSV and JSON from --db into a file or pipe: no limit)")
      .Check(app::WholeNumber(1, ResultSource::kAllRows));
  command
      .AddOption("--limit", options->limit_s,
                 "Seconds after which the query is stopped (default 30; CSV and JSON from --db into a file or pipe: 30 "
                 "for each row); 0 with --db: never")
      .Check(app::Number(0, ResultSource::kLongestLimit_s));
  AddListingOptions(command, &options->listing);
  AddSourceOptions(command, &options->source);
  command.SetFooter(
      "Views: benchmark_table, benchmark_cells, experiment_list, job_list, failures, disagreements, "
      "interpolation_cells");
  command.WhenChosen([=] { invocation->body = [options] { return Query(*options); }; });
}

}  // namespace legopt::client

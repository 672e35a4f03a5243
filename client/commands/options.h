#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/report/benchmark_table.h"
#include "client/report/listing.h"
#include "client/report/result_source.h"
#include "client/report/terminal.h"
#include "client/service/server_connection.h"
#include "client/suite/suite.h"

namespace CLI {
class App;
}

namespace legopt::client {

// Flags that several commands share. Each function adds them to `app`; the target must outlive the parse.

/// the network flags and --timeout
void AddNetworkOptions(CLI::App& app, NetworkOptions* options);
/// --db and those
void AddSourceOptions(CLI::App& app, SourceOptions* options);
/// --format text|markdown|csv|json
void AddFormatOption(CLI::App& app, ListingFormat* format);
/// --width, --color auto|always|never, --no-pager
void AddOutputOptions(CLI::App& app, OutputOptions* options);
/// How a command prints its listing; see PrintListing.
struct ListingOptions {
  ListingFormat format = ListingFormat::kText;
  std::vector<std::string> columns;  ///< only these, in this order; empty: all
  OutputOptions output;
};
/// --format, --columns and the output options
void AddListingOptions(CLI::App& app, ListingOptions* options);
/// --time-unit s|ms|us
void AddTimeUnitOption(CLI::App& app, TimeUnit* unit);
/// --format text|markdown|latex|csv|json
void AddTableFormatOption(CLI::App& app, TableFormat* format);
/// --format text|json
void AddTextOrJsonOption(CLI::App& app, bool* json);
/// --patience: for who waits for an experiment
void AddPatienceOption(CLI::App& app, double* patience_s);
/// --rule literal|strict
void AddRuleOption(CLI::App& app, std::string* rule);
/// --dataset
void AddDatasetOption(CLI::App& app, std::optional<std::string>* dataset);

/// A listing on standard output as its options say, through the pager where it is long. Throws ClientError (kUsage) for
/// a column that it does not have.
void PrintListing(const Listing& listing, const ListingOptions& options);

/// What `run` and `submit` share: the suite, what to keep of it, and the dataset.
struct SuiteOptions {
  std::string suite;
  std::optional<std::string> dataset;
  SuiteFilter filter;
  bool fresh = false;  ///< --new: a new experiment although one of the same content exists
};
void AddSuiteOptions(CLI::App& app, SuiteOptions* options);

}  // namespace legopt::client

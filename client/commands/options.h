#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "client/plot/plot.h"
#include "client/report/benchmark_table.h"
#include "client/report/listing.h"
#include "client/report/result_source.h"
#include "client/report/terminal.h"
#include "client/service/server_connection.h"
#include "client/suite/suite.h"
#include "programs/command_line.h"

namespace legopt::client {

// Flags that several commands share. Each function adds them to `command`; the target must outlive the parse.

/// the network flags and --timeout
void AddNetworkOptions(const programs::Command& command, NetworkOptions* options);
/// --db and those
void AddSourceOptions(const programs::Command& command, SourceOptions* options);
/// --format text|markdown|csv|json
void AddFormatOption(const programs::Command& command, ListingFormat* format);
/// --width, --color auto|always|never
void AddLayoutOptions(const programs::Command& command, OutputOptions* options);
/// Those, and --no-pager: for what may go through a pager
void AddOutputOptions(const programs::Command& command, OutputOptions* options);
/// How a command prints its listing; see PrintListing.
struct ListingOptions {
  ListingFormat format = ListingFormat::kText;
  std::vector<std::string> columns;  ///< only these, in this order; empty: all
  OutputOptions output;
};
/// --format, --columns and the output options
void AddListingOptions(const programs::Command& command, ListingOptions* options);
/// --time-unit s|ms|us
void AddTimeUnitOption(const programs::Command& command, TimeUnit* unit);
/// --format text|markdown|latex|csv|json
void AddTableFormatOption(const programs::Command& command, TableFormat* format);
/// --format text|json
void AddTextOrJsonOption(const programs::Command& command, bool* json);
/// --patience: for who waits for an experiment
void AddPatienceOption(const programs::Command& command, double* patience_s);
/// --give-up: for who waits for anything
void AddGiveUpOption(const programs::Command& command, std::optional<double>* give_up_s);
/// As a duration.
std::optional<std::chrono::duration<double>> GiveUpOf(const std::optional<double>& give_up_s);
/// Where figures go.
struct PlotOptions {
  bool text = false;
  std::string svg, png;  ///< files; empty: none

  bool any() const { return text || !svg.empty() || !png.empty(); }
};
/// --plot, --svg FILE, --png FILE; `what`: "performance profiles".
void AddPlotOptions(const programs::Command& command, const std::string& what, PlotOptions* options);
/// Text is drawn below text only: throws ClientError (kUsage) for --plot with another format.
void RequireTextForPlot(const PlotOptions& options, bool is_text);
/// Writes the files, and gives the text that is to be printed; empty without --plot. Errors as of RenderPlotImage and
/// ReplaceFile.
std::string DrawPlot(const Plot& plot, const PlotOptions& options, const TextLayout& layout);
/// --charge SECONDS: what a failed run costs in means of times
void AddChargeOption(const programs::Command& command, std::optional<double>* charge_s);
/// In ms.
std::optional<double> ChargeMs(const std::optional<double>& charge_s);
/// --rule literal|strict|solid, with its default in words.
void AddRuleOption(const programs::Command& command, std::optional<Rule>* rule,
                   const std::string& by_default = "the experiment's own");
/// --dataset
void AddDatasetOption(const programs::Command& command, std::optional<std::string>* dataset);

/// A listing on standard output as its options say, through the pager where it is long. Throws ClientError (kUsage) for
/// a column that it does not have.
void PrintListing(const Listing& listing, const ListingOptions& options);

/// A listing on standard output, without layout; CSV on a terminal has its control characters escaped.
void PrintPlain(const Listing& listing, ListingFormat format);

/// What `run` and `submit` share: the suite, what to keep of it, and the dataset.
struct SuiteOptions {
  std::string suite;
  std::optional<std::string> dataset;
  std::vector<std::filesystem::path> solvers;  ///< declarations of solvers of others
  SuiteFilter filter;
  bool fresh = false;  ///< --again: a new experiment, all of it solved, whatever exists
};
void AddSuiteOptions(const programs::Command& command, SuiteOptions* options);

}  // namespace legopt::client

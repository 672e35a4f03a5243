#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/command_line.h"
#include "client/plot/plot.h"
#include "client/report/benchmark_table.h"
#include "client/report/listing.h"
#include "client/report/output.h"
#include "client/report/result_source.h"
#include "client/service/server_connection.h"
#include "client/suite/suite.h"

namespace legopt::client {

// Options shared by several commands. Each function adds them to `command`; the target must outlive parsing.

/// Adds the network flags and --timeout.
void AddNetworkOptions(const app::Command& command, NetworkOptions* options);
/// Adds --db and the network options.
void AddSourceOptions(const app::Command& command, SourceOptions* options);
/// Adds --format text|markdown|latex|csv|json.
void AddFormatOption(const app::Command& command, TableFormat* format);
/// Adds --width, --color auto|always|never.
void AddLayoutOptions(const app::Command& command, OutputOptions* options);
/// Adds the layout options and --no-pager, for output that may go through a pager.
void AddOutputOptions(const app::Command& command, OutputOptions* options);
/// Adds --rows or another option; `noun` names the rows in the help, e.g. "methods".
void AddRowsOption(const app::Command& command, std::vector<std::string>* rows, const std::string& noun = "rows",
                   const std::string& name = "--rows");
/// Adds --columns.
void AddColumnsOption(const app::Command& command, std::vector<std::string>* columns);
/// Output options of a listing; see PrintListing.
struct ListingOptions {
  TableFormat format = TableFormat::kText;
  std::vector<std::string> rows;     ///< rows to show; empty: all
  std::vector<std::string> columns;  ///< columns to show, in this order; empty: all
  OutputOptions output;
};
/// Adds --format, --rows, --columns and the output options.
void AddListingOptions(const app::Command& command, ListingOptions* options);
/// Adds --time-unit s|ms|us.
void AddTimeUnitOption(const app::Command& command, TimeUnit* unit);
/// Adds --format text|json.
void AddTextOrJsonOption(const app::Command& command, bool* json);
/// Adds --patience, for commands that wait for an experiment.
void AddPatienceOption(const app::Command& command, double* patience_s);
/// Adds --give-up, for commands that wait.
void AddGiveUpOption(const app::Command& command, std::optional<double>* give_up_s);
/// Converts to a duration.
std::optional<std::chrono::duration<double>> GiveUpOf(const std::optional<double>& give_up_s);
/// Destinations of figures.
struct PlotOptions {
  bool text = false;
  std::string svg;          ///< file name; empty: none
  std::string removed_png;  ///< value of the removed option --png, for its error

  bool any() const { return text || !svg.empty(); }
};
/// Adds --plot and --svg FILE; `what` describes the figure, e.g. "performance profiles".
void AddPlotOptions(const app::Command& command, const std::string& what, PlotOptions* options);
/// Throws ClientError (kUsage) for --plot with a format other than text, and for --png.
void CheckPlotOptions(const PlotOptions& options, bool is_text);
/// Writes the file, and returns the text to be printed; empty without --plot. Throws the errors of RenderFigure and
/// ReplaceFile.
std::string DrawPlot(const Plot& plot, const PlotOptions& options, const TextLayout& layout);
/// Adds --charge SECONDS: the time charged for a failed run in mean times.
void AddChargeOption(const app::Command& command, std::optional<double>* charge_s);
/// Converts to ms.
std::optional<double> ChargeMs(const std::optional<double>& charge_s);
/// Adds --rule literal|strict|solid|physical; `by_default` describes the default.
void AddRuleOption(const app::Command& command, std::optional<Rule>* rule,
                   const std::string& by_default = "the experiment's own");
/// Adds --dataset.
void AddDatasetOption(const app::Command& command, std::optional<std::string>* dataset);

/// Prints a table on standard output, through the pager if it is long. Throws the errors of KeepRows and
/// KeepColumns.
void PrintTable(const Table& table, const ListingOptions& options);
/// Returns the rows and columns of the table that the options select. Throws like PrintTable.
Table SelectedPart(Table table, const ListingOptions& options);
void PrintListing(const Listing& listing, const ListingOptions& options);

/// Prints a listing on standard output without layout; control characters of CSV are escaped on a terminal.
void PrintPlain(const Listing& listing, TableFormat format);

/// Common options of `run` and `submit`: the suite, its filters, and the dataset.
struct SuiteOptions {
  std::string suite;
  std::optional<std::string> dataset;
  std::vector<std::filesystem::path> solvers;  ///< description files of external solvers
  SuiteFilter filter;
  bool null_row = false;  ///< --null: add a copy of the first method
  bool fresh = false;     ///< --again: create a new experiment and solve all its jobs
};
void AddSuiteOptions(const app::Command& command, SuiteOptions* options);

}  // namespace legopt::client

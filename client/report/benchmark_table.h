#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "client/report/listing.h"
#include "client/report/result_source.h"
#include "client/report/table.h"
#include "client/report/text_layout.h"
#include "legopt/types/check.h"
#include "legopt/types/collision.h"
#include "legopt/types/experiment.h"
#include "legopt/types/result.h"
#include "legopt/types/task.h"

namespace legopt::client {

struct BenchmarkColumn {
  Task task{};
  Initialization initialization{};

  auto operator<=>(const BenchmarkColumn&) const = default;
};

/// Every combination of task and initialization; the paper's columns come first, in its order.
inline constexpr auto kTableColumns = [] {
  std::array<BenchmarkColumn, kNumEnumerators<Task> * kNumEnumerators<Initialization>> columns{};
  std::size_t i = 0;
  for (const TaskDescription& description : kTasks) {
    for (const auto& start : kEnumNames<Initialization>) columns[i++] = {description.task, start.value};
  }
  return columns;
}();

/// Columns of the tasks in the paper.
inline constexpr auto kPaperColumns = [] {
  constexpr std::size_t kPaperTasks = 2;
  std::array<BenchmarkColumn, kPaperTasks * kNumEnumerators<Initialization>> columns{};
  for (std::size_t i = 0; i < columns.size(); ++i) columns[i] = kTableColumns[i];
  return columns;
}();

/// Number of jobs, and of solved ones.
struct JobCounts {
  std::int64_t n = 0;
  std::int64_t solved = 0;

  bool operator==(const JobCounts&) const = default;
  JobCounts& operator+=(const JobCounts& other) {
    n += other.n;
    solved += other.solved;
    return *this;
  }
  JobCounts& operator-=(const JobCounts& other) {
    n -= other.n;
    solved -= other.solved;
    return *this;
  }
};

/// One method, task and initialization.
struct BenchmarkCell {
  std::int64_t n = 0;            ///< number of jobs
  std::int64_t finished = 0;     ///< number of jobs in a final state
  std::int64_t solved = 0;       ///< successes by the judge's verdict under the table's rule
  std::optional<double> cost;    ///< mean per waypoint over solved problems; nullopt if none was solved
  std::optional<double> time_s;  ///< mean CPU time per waypoint over solved problems; nullopt if none was solved
  // Finished jobs without a result:
  std::int64_t dead = 0;    ///< crashed, hung or exceeded its memory at every attempt
  std::int64_t failed = 0;  ///< could not be run
  std::int64_t cancelled = 0;
  // n = problems x repetitions; 0 problems: unknown
  std::int64_t problems = 0;
  std::int64_t repetitions = 1;
  /// Jobs stopped by the wall-time limit at every attempt, or before effort limits existed; not a property of the
  /// method.
  std::int64_t clock_stopped = 0;
  std::int64_t taken_over = 0;  ///< finished jobs whose result was reused from an identical job of another experiment
  std::int64_t solved_by_other_rule = 0;                  ///< successes under BenchmarkTable::other_rule, if set
  EnumArray<Feasibility, JobCounts> by_feasibility = {};  ///< counts by feasibility of the problem, in a table with a
                                                          ///< certificate

  bool operator==(const BenchmarkCell&) const = default;
};

/// Initial points of results beyond the first one of each window.
struct FurtherStarts {
  double mean = 0.0;
  std::int64_t largest = 0;
};

struct BenchmarkRow {
  std::string method;
  std::int64_t multi_starts = 0;
  std::int64_t sample_size = 100;  ///< percent
  std::map<BenchmarkColumn, BenchmarkCell> cells;
  SceneRepresentation collision = SceneRepresentation::kSolid;  ///< the solver's model of obstacles
  std::map<BenchmarkColumn, BenchmarkCell> paper = {};  ///< the paper's figures of this row; empty if not requested
  std::int64_t inner_starts = 0;                        ///< largest number of internal restarts of an attempt
  std::optional<FurtherStarts> further_starts = {};     ///< of methods with internal restarts; nullopt: not read
  std::int64_t method_id = 0;                           ///< id in the database; 0: not from a database
};

/// Method that finds postures for certificates.
inline constexpr std::string_view kCertificateFinder = "LegOpt-best's SQP";

/// Description of a certificate.
struct CertificateFacts {
  std::string hash;  ///< BLAKE2b-256 of the file, 64 hex digits
  int starts = 0;    ///< starts per stance; 0: unknown
};

/// The paper's Table I for an experiment.
struct BenchmarkTable {
  std::int64_t experiment_id = 0;
  std::string experiment;
  std::string dataset;        ///< name; empty if unknown
  Split split = Split::kAll;  ///< subset of its problems
  Rule rule = Rule::kSolid;
  std::vector<BenchmarkColumn> columns;              ///< columns that the experiment has, in the paper's order
  std::vector<BenchmarkRow> rows;                    ///< ordered as in the experiment
  bool compared = false;                             ///< the paper's figures were requested
  std::vector<ResultProvenance> origins;             ///< builds and machines of the results
  std::optional<CertificateFacts> certificate = {};  ///< counts by a certificate: BenchmarkCell::by_feasibility
  std::optional<Rule> other_rule = {};               ///< rule of BenchmarkCell::solved_by_other_rule; nullopt: unknown

  /// Returns the jobs over which success is counted: all, but with a certificate those of infeasible problems.
  JobCounts Counted(const BenchmarkCell& cell) const;

  /// True if rows differ in their collision model, so that a column is needed.
  bool shows_collision() const;
  /// Sum of all cells; contains numbers of jobs only.
  BenchmarkCell Sum() const;
};

/// Returns e.g. "posture_in_collision".
std::string ColumnName(const BenchmarkColumn& column);

/// Returns e.g. "Posture generation, init in collision".
std::string ColumnTitle(const BenchmarkColumn& column);

/// Returns the statement that reads a table's cells: columns method_id, method, multi_starts, sample_size, collision,
/// task, initialization, n, finished, solved, cost, time_s, experiment, dead, failed, cancelled, problems, repetitions,
/// clock_stopped, taken_over, inner_starts.
std::string BenchmarkCellsSql(std::int64_t experiment_id, Rule rule);

/// Builds the table from the rows of BenchmarkCellsSql. Columns are in the order of kTableColumns; columns that no
/// method has are omitted. The method's id is appended to names of indistinguishable rows.
BenchmarkTable BuildBenchmarkTable(const Listing& cells, std::int64_t experiment_id, Rule rule);

/// Unit in which times are displayed. It never depends on the data, so that tables are comparable.
struct TimeUnit {
  const char* name;
  double seconds;  ///< seconds per unit
};
inline constexpr TimeUnit kSeconds{"s", 1.0}, kMilliseconds{"ms", 1e-3}, kMicroseconds{"us", 1e-6};

/// Appends "(method ID)" to the names of indistinguishable rows: methods may differ in options that no column shows.
/// `method_ids`: one per row.
template <class Row>
void DisambiguateRows(const std::vector<std::int64_t>& method_ids, std::vector<Row>* rows) {
  const auto key = [](const Row& row) {
    return std::tuple(row.method, row.multi_starts, row.sample_size, row.collision);
  };
  std::map<decltype(key(std::declval<const Row&>())), int> seen;
  for (const auto& row : *rows) ++seen[key(row)];
  for (std::size_t i = 0; i < rows->size(); ++i) {
    Row& row = (*rows)[i];
    if (seen[key(row)] > 1) row.method += " (method " + std::to_string(method_ids[i]) + ")";
  }
}

/// Formats a cost as in the paper: an integer if >= 1, else two decimals (more if the cost would be shown as 0.00).
std::string FormatCost(const std::optional<double>& cost);
/// Formats a time in `unit`, with three significant digits or all digits before the point.
std::string FormatTime(const std::optional<double>& time_s, const TimeUnit& unit);
/// Returns successes as "34/35", with abnormal outcomes in parentheses: "34/35 (1 dead)", "29/35 (2 failed, 5 left)".
TableCell ShownSuccess(const BenchmarkCell& cell);
/// Returns successes over the problems that are not proven infeasible: "34/35 (1 open, 0 of 2 infeasible)".
TableCell ShownCertifiedSuccess(const BenchmarkCell& cell);

/// Returns the note below a table with jobs stopped by the wall-time limit; empty if there are none.
std::string ClockWarning(std::int64_t clock_stopped, std::int64_t experiment_id);

/// Style and extent of rendered tables.
struct TableStyle {
  TimeUnit time_unit = kMilliseconds;
  TextLayout layout = {};
  /// Values of --columns; empty: all. Names of columns are those of CSV for CSV and JSON, and those of the displayed
  /// table otherwise. JSON is then an array of rows, as for a listing.
  std::vector<std::string> columns = {};
};

/// Returns the columns that identify a method: name, multi-starts, sample size.
std::vector<TableColumn> MethodColumns();

/// Returns the table in the paper's layout, with times in `unit`.
Table TableOf(const BenchmarkTable& table, const TimeUnit& unit);

/// Renders a table, with a final newline. All formats have the same rows, counts and means:
/// * text, Markdown and LaTeX have the paper's layout, with the formatting functions above and "-" if nothing was
///   solved. The paper's figures are on a separate line below each row. With colour, cells with dead or failed jobs are
///   red; the largest share of solved problems in a column is bold, and so are the lowest cost and time among the rows
///   with that share;
/// * CSV and JSON contain the same cells unrounded, times in seconds, and empty or null if nothing was solved. CSV has
///   the same columns for every experiment: posture_good_n, ..._problems, ..._repetitions, ..._finished, ..._solved,
///   ..._dead, ..._failed, ..._cancelled, ..._clock_stopped, ..._taken_over, ..._cost, ..._time_s, and equal ones for
///   the other kPaperColumns, followed by those of further columns of the table. With the paper's figures:
///   paper_posture_good_n, ...; with a certificate: posture_good_certified_n, ..._certified_solved, ..._infeasible_n,
///   ...; JSON has those in members "paper" and "by_feasibility".
std::string RenderBenchmarkTable(const BenchmarkTable& table, TableFormat format, const TableStyle& style = {});

/// Returns the JSON as an object, to be inserted into a larger one.
nlohmann::ordered_json BenchmarkTableJson(const BenchmarkTable& table);

/// Reads the paper's Table I from data/paper-table1.csv, in the order of its rows. Lines that start with '#' are
/// comments; an empty field is a dash. Throws InputError with file, line and column.
std::vector<BenchmarkRow> ReadPaperTable(const std::filesystem::path& file);

/// Adds the paper's figures to every row of the table with the same method (ignoring case), multi-starts and sample
/// size.
void AddPaperFigures(const std::vector<BenchmarkRow>& paper, BenchmarkTable* table);

}  // namespace legopt::client

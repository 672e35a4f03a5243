#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "client/report/listing.h"
#include "client/report/result_origins.h"
#include "client/report/text_layout.h"
#include "words/collision.h"
#include "words/feasibility.h"
#include "words/result.h"
#include "words/split.h"
#include "words/task.h"

namespace legopt::client {

enum class TableFormat { kText, kMarkdown, kLatex, kCsv, kJson };

struct BenchmarkColumn {
  Task task{};
  Initialization initialization{};

  auto operator<=>(const BenchmarkColumn&) const = default;
};

/// Every task from every initialization; the paper's columns, in its order, come first.
inline constexpr auto kTableColumns = [] {
  std::array<BenchmarkColumn, kNumWords<Task> * kNumWords<Initialization>> columns{};
  std::size_t i = 0;
  for (const TaskDescription& description : kTasks) {
    for (const auto& start : kWords<Initialization>) columns[i++] = {description.task, start.value};
  }
  return columns;
}();

/// Those of the tasks that the paper has.
inline constexpr auto kPaperColumns = [] {
  constexpr std::size_t kPaperTasks = 2;
  std::array<BenchmarkColumn, kPaperTasks * kNumWords<Initialization>> columns{};
  for (std::size_t i = 0; i < columns.size(); ++i) columns[i] = kTableColumns[i];
  return columns;
}();

/// Jobs, and those that were solved.
struct JobCounts {
  std::int64_t n = 0;
  std::int64_t solved = 0;

  bool operator==(const JobCounts&) const = default;
};

/// One method on one task from one initialization.
struct BenchmarkCell {
  std::int64_t n = 0;            ///< jobs of the cell
  std::int64_t finished = 0;     ///< jobs that will not change any more
  std::int64_t solved = 0;       ///< successes by the judge's verdict under the table's rule
  std::optional<double> cost;    ///< mean over solved problems, per waypoint; none when nothing was solved
  std::optional<double> time_s;  ///< likewise, wall seconds of the solve per waypoint
  // Of the finished jobs, those that have no result:
  std::int64_t dead = 0;       ///< ended their process (crashed, hung, grew too large) at every attempt
  std::int64_t failed = 0;     ///< could not run at all
  std::int64_t cancelled = 0;  ///< were taken back
  // n = problems x repetitions; 0 problems: not known
  std::int64_t problems = 0;
  std::int64_t repetitions = 1;
  /// Ended by the clock, at every attempt or before there were limits of effort: they say nothing about the method.
  std::int64_t clock_stopped = 0;
  std::int64_t taken_over = 0;  ///< of the finished jobs: with the result of an equal job of another experiment
  std::int64_t solved_by_other_rule = 0;            ///< successes under BenchmarkTable::other_rule, if there is one
  Per<Feasibility, JobCounts> by_feasibility = {};  ///< of their problems, in a table that counts by a certificate

  bool operator==(const BenchmarkCell&) const = default;
};

struct BenchmarkRow {
  std::string method;
  std::int64_t multi_starts = 0;
  std::int64_t sample_size = 100;  ///< percent
  std::map<BenchmarkColumn, BenchmarkCell> cells;
  SceneRepresentation collision = SceneRepresentation::kSolid;  ///< the solver's obstacles
  std::map<BenchmarkColumn, BenchmarkCell> paper = {};  ///< the paper's figures of this row; empty: not asked for
  std::int64_t inner_starts = 0;                        ///< that an attempt may make beyond its first one
  std::int64_t method_id = 0;                           ///< in the database; 0: from elsewhere
};

/// The paper's Table I for one experiment.
struct BenchmarkTable {
  std::int64_t experiment_id = 0;
  std::string experiment;
  std::string dataset;        ///< name; empty: not known
  Split split = Split::kAll;  ///< which of its problems
  Rule rule = Rule::kSolid;
  std::vector<BenchmarkColumn> columns;  ///< in the paper's order, only those that the experiment has
  std::vector<BenchmarkRow> rows;        ///< in the experiment's order
  bool compared = false;                 ///< the paper's figures were asked for
  std::vector<ResultOrigin> origins;     ///< builds and machines of the results
  bool certified = false;                ///< counts by a certificate: BenchmarkCell::by_feasibility
  std::optional<Rule> other_rule = {};   ///< rule of BenchmarkCell::solved_by_other_rule; none: not known

  /// Jobs that success is counted over: all, or those of certified problems.
  JobCounts Counted(const BenchmarkCell& cell) const;

  /// Whether rows differ in their collision model, so that it needs a column.
  bool shows_collision() const;
  /// All cells in one: sums of the numbers of jobs, nothing else.
  BenchmarkCell Sum() const;
};

/// "posture_in_collision".
std::string ColumnName(const BenchmarkColumn& column);

/// The statement that reads a table's cells: columns method_id, method, multi_starts, sample_size, collision, task,
/// initialization, n, finished, solved, cost, time_s, experiment, dead, failed, cancelled, problems, repetitions,
/// clock_stopped, taken_over, inner_starts.
std::string BenchmarkCellsSql(std::int64_t experiment_id, Rule rule);

/// Makes the table from the rows of that statement. Columns come in the order of kTableColumns; what no method has is
/// left out. Rows that would read the same get the method's id
/// behind their name.
BenchmarkTable BuildBenchmarkTable(const Listing& cells, std::int64_t experiment_id, Rule rule);

/// The unit in which times are shown. It never depends on the data, so that tables can be compared.
struct TimeUnit {
  const char* name;
  double seconds;  ///< one unit
};
inline constexpr TimeUnit kSeconds{"s", 1.0}, kMilliseconds{"ms", 1e-3}, kMicroseconds{"us", 1e-6};

/// Appends "(method ID)" to the names of rows that would read the same: methods may differ in options that no column
/// shows. `method_ids`: one per row.
template <class Row>
void TellRowsApart(const std::vector<std::int64_t>& method_ids, std::vector<Row>* rows) {
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

/// As the paper prints it: an integer when >= 1, else two decimals (more where the cost would read 0.00).
std::string FormatCost(const std::optional<double>& cost);
/// In `unit`, with three significant digits or all before the point.
std::string FormatTime(const std::optional<double>& time_s, const TimeUnit& unit);
/// "34/35", and in parentheses what did not end as it should: "34/35 (1 dead)", "29/35 (2 failed, 5 left)". Brief:
/// "34/35 1d", "29/35 2f 5l", as kSuccessLegend explains.
std::string FormatSuccess(const BenchmarkCell& cell);
std::string FormatBriefSuccess(const BenchmarkCell& cell);
/// The same over certified problems, the rest behind it: "34/34 (0 of 1 open)". Brief: "34/34 0/1o", and i for
/// infeasible.
std::string FormatCertifiedSuccess(const BenchmarkCell& cell);
std::string FormatBriefCertifiedSuccess(const BenchmarkCell& cell);
inline constexpr char kCertifiedLegend[] = "Solved of certified problems; o solved of open ones, i of infeasible ones.";
inline constexpr char kSuccessLegend[] = "Behind n: d dead, f failed to run, c cancelled, l left to do.";

/// What stands below a table when the clock has ended so many of its jobs; empty for none.
std::string ClockWarning(std::int64_t clock_stopped, std::int64_t experiment_id);

/// How tables of text are shown.
struct TableStyle {
  TimeUnit time_unit = kMilliseconds;
  TextLayout layout = {};
};

/// Renders a table, with a final newline. All formats have the same rows, counts and means:
/// * text, Markdown and LaTeX (booktabs) show the paper's layout with the formatting functions above and "-" where
///   nothing was solved; the header states the time unit; the paper's figures stand in a line of their own below.
///   With colour, cells with dead or failed jobs are red, and bold are the largest share of solved problems of a
///   column and, among the rows that have it, the lowest cost and time;
/// * CSV and JSON hold the same cells unrounded, times in seconds, and nothing (null) where nothing was solved. CSV has
///   the same columns for every experiment: posture_good_n, ..._problems, ..._repetitions, ..._finished, ..._solved,
///   ..._dead, ..._failed, ..._cancelled, ..._clock_stopped, ..._taken_over, ..._cost, ..._time_s, likewise for the
///   other of kPaperColumns, and behind them for what else the table has; with the paper's figures
///   paper_posture_good_n, ..., with a certificate posture_good_certified_n, ..._certified_solved, ..._infeasible_n,
///   ...; JSON has those in members "paper" and "by_feasibility".
std::string RenderBenchmarkTable(const BenchmarkTable& table, TableFormat format, const TableStyle& style = {});

/// The JSON of that, for who puts it into a larger one.
nlohmann::ordered_json BenchmarkTableJson(const BenchmarkTable& table);

}  // namespace legopt::client

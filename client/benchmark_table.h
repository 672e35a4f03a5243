#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/listing.h"

namespace legopt::client {

enum class TableFormat { kText, kMarkdown, kLatex, kCsv, kJson };

/// One method on one task from one initialization.
struct BenchmarkCell {
  std::int64_t n = 0;            ///< jobs of the cell
  std::int64_t finished = 0;     ///< jobs that will not change any more
  std::int64_t solved = 0;       ///< successes by the judge's verdict under the table's rule
  std::optional<double> cost;    ///< mean over solved problems, per waypoint; none when nothing was solved
  std::optional<double> time_s;  ///< likewise, wall seconds of the solve per waypoint

  bool operator==(const BenchmarkCell&) const = default;
};

/// Task and initialization, e.g. {"posture", "in_collision"}.
using BenchmarkColumn = std::pair<std::string, std::string>;

struct BenchmarkRow {
  std::string method;
  std::int64_t multi_starts = 0;
  std::int64_t sample_size = 100;  ///< percent
  std::map<BenchmarkColumn, BenchmarkCell> cells;
  std::string collision = "solid";                      ///< the solver's obstacles: "solid" or "surface"
  std::map<BenchmarkColumn, BenchmarkCell> paper = {};  ///< the paper's figures of this row; empty: not asked for
};

/// The paper's Table I for one experiment.
struct BenchmarkTable {
  std::int64_t experiment_id = 0;
  std::string experiment;
  std::string dataset;                   ///< name; empty: not known
  std::string rule;                      ///< "literal" or "strict"
  std::vector<BenchmarkColumn> columns;  ///< in the paper's order, only those that the experiment has
  std::vector<BenchmarkRow> rows;        ///< in the experiment's order

  /// Whether rows differ in their collision model, so that it needs a column.
  bool shows_collision() const;
  std::int64_t num_jobs() const;
  std::int64_t num_finished() const;
};

/// The statement that reads a table's cells: columns method_id, method, multi_starts, sample_size, collision, task,
/// initialization, n, finished, solved, cost, time_s, experiment.
std::string BenchmarkCellsSql(std::int64_t experiment_id, const std::string& rule);

/// Makes the table from the rows of that statement. Columns come in the order posture/good, posture/in_collision,
/// motion/good, motion/in_collision; what no method has is left out.
BenchmarkTable BuildBenchmarkTable(const Listing& cells, std::int64_t experiment_id, const std::string& rule);

/// The unit in which a table's times are shown: the largest one in which their geometric mean is at least 1.
struct TimeUnit {
  std::string name;  ///< "s", "ms" or "us"
  double seconds;    ///< one unit
};
TimeUnit ChooseTimeUnit(const BenchmarkTable& table);

/// As the paper prints it: an integer when >= 1, else two decimals (more where the cost would read 0.00).
std::string FormatCost(const std::optional<double>& cost);
/// Three significant digits in `unit`.
std::string FormatTime(const std::optional<double>& time_s, const TimeUnit& unit);
/// "34/35", with " (5 left)" while jobs of the cell are unfinished.
std::string FormatSuccess(const BenchmarkCell& cell);

/// Renders a table, with a final newline. All formats have the same rows, columns, counts and means:
/// * text, Markdown and LaTeX (booktabs) show the paper's layout with the formatting functions above and "-" where
///   nothing was solved; the header states the time unit; the paper's figures stand in a line of their own below;
/// * CSV and JSON hold the same cells unrounded, times in seconds, and nothing (null) where nothing was solved. CSV
///   column names are those of the database's view: posture_good_n, ..._finished, ..._solved, ..._cost, ..._time_s;
///   the paper's figures are paper_posture_good_n, ... and a member "paper".
std::string RenderBenchmarkTable(const BenchmarkTable& table, TableFormat format);

}  // namespace legopt::client

#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/report/benchmark_table.h"
#include "client/report/listing.h"
#include "words/split.h"

namespace legopt::client {

/// The task that the view `interpolation_cells` is about: the one whose solutions are scored between their waypoints.
inline constexpr const TaskDescription& kInterpolatedTask =
    *std::ranges::find(kTasks, Between::kScored, &TaskDescription::between);

/// What lies between the waypoints of the solutions of one method from one initialization. Depths are the largest
/// of all of them, by the exact meshes.
struct InterpolationCell {
  std::int64_t n = 0;                     ///< jobs of the cell
  std::int64_t solved = 0;                ///< by the table's rule
  std::int64_t scored = 0;                ///< solved ones whose interpolation was looked at
  std::int64_t free = 0;                  ///< of these: no transition penetrates by more than 1 mm
  std::optional<double> free_share = {};  ///< mean share of such transitions, 0 .. 1
  std::optional<double> environment_depth_m = {};
  std::optional<double> self_depth_m = {};
  std::int64_t clock_stopped = 0;  ///< of the n: ended by the clock
};

struct InterpolationRow {
  std::string method;
  std::int64_t multi_starts = 0;
  std::int64_t sample_size = 100;
  SceneRepresentation collision = SceneRepresentation::kSolid;
  std::map<Initialization, InterpolationCell> cells;
  std::int64_t inner_starts = 0;  ///< that an attempt may make beyond its first one
};

/// The solutions of one experiment, seen between their waypoints.
struct InterpolationTable {
  std::int64_t experiment_id = 0;
  std::string experiment;
  std::string dataset;        ///< name; empty: not known
  Split split = Split::kAll;  ///< which of its problems
  Rule rule = Rule::kSolid;
  std::vector<InterpolationRow> rows;
  std::vector<ResultOrigin> origins;  ///< builds and machines of the results
  std::int64_t taken_over = 0;        ///< results of the experiment, other tasks included, that others made

  bool shows_collision() const;
};

/// The statement that reads the cells of the view `interpolation_cells`, in the order of the benchmark table.
std::string InterpolationCellsSql(std::int64_t experiment_id, Rule rule);

/// Makes the table from the rows of that statement.
InterpolationTable BuildInterpolationTable(const Listing& cells, std::int64_t experiment_id, Rule rule);

/// As RenderBenchmarkTable: text, Markdown and LaTeX show the free ones of those scored, the share of free
/// transitions in percent and depths in mm; CSV and JSON hold the same cells unrounded, depths in metres.
std::string RenderInterpolationTable(const InterpolationTable& table, TableFormat format,
                                     const TextLayout& layout = {});

}  // namespace legopt::client

#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/report/benchmark_table.h"
#include "client/report/listing.h"
#include "legopt/types/experiment.h"

namespace legopt::client {

/// The task of the view `interpolation_cells`, whose solutions are scored between waypoints.
inline constexpr const TaskDescription& kInterpolatedTask =
    *std::ranges::find(kTasks, TransitionRule::kScored, &TaskDescription::between);

/// Values between the waypoints of the solutions of one method and initialization. Depths are maxima over all
/// solutions, by the exact meshes.
struct InterpolationCell {
  std::int64_t n = 0;                     ///< number of jobs
  std::int64_t solved = 0;                ///< number of successes by the table's rule
  std::int64_t scored = 0;                ///< number of solved jobs whose interpolation was scored
  std::int64_t free = 0;                  ///< number of scored jobs without a transition that penetrates by more than 1
                                          ///< mm
  std::optional<double> free_share = {};  ///< mean share of such transitions, 0 .. 1
  std::optional<double> environment_depth_m = {};
  std::optional<double> self_depth_m = {};
  std::int64_t clock_stopped = 0;  ///< number of jobs stopped by the wall-time limit
};

struct InterpolationRow {
  std::string method;
  std::int64_t multi_starts = 0;
  std::int64_t sample_size = 100;
  SceneRepresentation collision = SceneRepresentation::kSolid;
  std::map<Initialization, InterpolationCell> cells;
  std::int64_t inner_starts = 0;  ///< internal restarts of an attempt beyond its first start
  std::int64_t method_id = 0;     ///< id in the database
};

/// The solutions of an experiment between their waypoints.
struct InterpolationTable {
  std::int64_t experiment_id = 0;
  std::string experiment;
  std::string dataset;        ///< name; empty if unknown
  Split split = Split::kAll;  ///< subset of its problems
  Rule rule = Rule::kSolid;
  std::vector<InterpolationRow> rows;
  std::vector<ResultProvenance> origins;  ///< builds and machines of the results
  std::int64_t taken_over = 0;            ///< number of results reused from other experiments, including other tasks

  bool shows_collision() const;
  /// Returns the initializations that the rows have.
  std::vector<Initialization> Initializations() const;
};

/// Returns the statement that reads the view `interpolation_cells`, in the order of the benchmark table.
std::string InterpolationCellsSql(std::int64_t experiment_id, Rule rule);

/// Builds the table from the rows of InterpolationCellsSql.
InterpolationTable BuildInterpolationTable(const Listing& cells, std::int64_t experiment_id, Rule rule);

/// Returns the table as displayed: free of scored solutions, the share of free transitions in percent, depths in mm.
Table TableOf(const InterpolationTable& table);

/// Renders the table like RenderBenchmarkTable: text, Markdown and LaTeX show free of scored solutions, the share of
/// free transitions in percent and depths in mm; CSV and JSON contain the same cells unrounded, depths in metres.
std::string RenderInterpolationTable(const InterpolationTable& table, TableFormat format, const TableStyle& style = {});

}  // namespace legopt::client

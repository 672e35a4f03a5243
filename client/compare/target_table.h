#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/compare/solves.h"
#include "client/compare/statistics_table.h"
#include "client/report/reading.h"
#include "legopt/types/check.h"

namespace legopt::client {

/// A target: a run reaches it if it solves its problem at a cost of at most `ratio` times the best known cost.
struct TargetFigures {
  double reached = 0.0;          ///< sum over the problems of the share of runs that reach it
  std::optional<double> ert_ms;  ///< expected effort until a run reaches it: that of all runs over the number of runs
                                 ///< that reach it; nullopt: none does
};

/// One method, task and initialization. The unit is the problem, with its repetitions averaged.
struct TargetCell {
  int n = 0;                           ///< number of problems with a finished run
  std::vector<TargetFigures> targets;  ///< parallel to TargetTable::ratios
  /// Median and 95 % quantile of cost / best known cost - 1 over all problems, unsolved ones at infinity; the cost is
  /// the mean of the solved runs.
  double gap_median = 0.0, gap_q95 = 0.0;
};

/// Runs by fixed targets, as in COCO (Hansen et al. 2021, Optim. Methods Softw. 36:114), for the final solutions of
/// runs. The best known cost of a problem is the lowest of all runs of the shown rows, from all initializations.
struct TargetTable {
  StatisticsTable statistics;               ///< experiment, titles of the rows
  std::vector<double> ratios;               ///< ratio of each target, >= 1
  std::map<BenchmarkColumn, bool> by_work;  ///< effort is work, because it was counted for all runs of the column; else
                                            ///< CPU time
  std::vector<std::map<BenchmarkColumn, TargetCell>> cells;  ///< parallel to statistics.rows
};

/// Computes the figures of an experiment whose solves have been read by `rule`. Missing runs do not count.
TargetTable ComputeTargets(const SolvedExperiment& experiment, Rule rule, const std::vector<double>& ratios);

/// Renders the table: one row per method, task and initialization. CSV and JSON have unrounded values, with an infinite
/// gap as null.
std::string RenderTargetTable(const TargetTable& table, TableFormat format, const TableStyle& style = {});

}  // namespace legopt::client

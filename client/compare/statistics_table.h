#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/compare/solves.h"
#include "client/report/reading.h"
#include "legopt/statistics/interval.h"
#include "legopt/statistics/many_methods.h"

namespace legopt::client {

/// What a failed run is charged, in limits, and the shift of geometric means of times.
inline constexpr double kPenaltyFactor = 10.0;
inline constexpr double kShift_ms = 1.0;

/// One method on one task from one start. The unit is the problem, its repetitions averaged before; nothing is known of
/// missing ones. Times are of whole solves. Infinite: more problems were not solved than that. None: nothing to
/// compute it of.
struct CellStatistics {
  int n = 0;                                          ///< problems with a finished run
  int missing = 0;                                    ///< problems without: queued, running or cancelled
  int runs = 0;                                       ///< finished ones
  double solved = 0.0;                                ///< sum of the problems' shares of solved runs
  statistics::Interval share;                         ///< Wilson's 95 % interval of solved / n
  std::optional<double> time_median_ms, time_q95_ms;  ///< of all n problems, an unsolved one at infinity
  std::optional<double> cost_median, cost_q95;        ///< likewise
  std::optional<double> par10_ms;                     ///< mean time, a failed run at ten limits
  std::optional<double> ert_ms;                       ///< time of all runs over the number of successes
  std::optional<double> common_time_ms;  ///< shifted geometric mean over the problems that all methods solved
  std::optional<double> common_cost;     ///< geometric mean over the same
  std::optional<double> mean_rank;       ///< by time among the methods, on problems that none misses; failures last
  double cpu_ms = 0.0;                   ///< of all runs
  int reported = 0;                      ///< runs that have a result
  int contended = 0;                     ///< of these, runs that others disturbed
  int stopped = 0;                       ///< of these, runs that a limit of the solver ended
};

/// A task from a start: what its methods have in common.
struct ColumnStatistics {
  int common = 0;                                  ///< problems that all of its methods solved
  int complete = 0;                                ///< problems that no method misses
  std::optional<statistics::CochranTest> success;  ///< none: fewer than three methods, or several repetitions
};

struct StatisticsRow {
  MethodIdentity method;
  std::string title;  ///< as in the benchmark table: its name, "(method ID)" behind it where rows would read the same
  std::map<BenchmarkColumn, CellStatistics> cells;
};

/// Statistics of one experiment.
struct StatisticsTable {
  ExperimentInfo experiment;
  std::int64_t seed = 0;
  std::int64_t repetitions = 1;
  Rule rule = Rule::kLiteral;
  std::map<BenchmarkColumn, ColumnStatistics> columns;
  std::vector<StatisticsRow> rows;  ///< in the experiment's order
  std::vector<ResultOrigin> origins;
  std::int64_t clock_stopped = 0;  ///< as of SolvedExperiment
};

/// The figures of an experiment whose solves have been read. `rule` as they were.
StatisticsTable ComputeStatistics(const SolvedExperiment& experiment, Rule rule);

/// Reads and computes. Errors as of ReadBenchmarkTable.
StatisticsTable ReadStatisticsTable(ResultSource& source, const TableSelection& selection);

/// Text, Markdown and LaTeX: a table for each task and start, CSV and JSON: all figures unrounded, a row for each
/// method, task and start, times in ms; what is infinite or not there is empty or null.
std::string RenderStatisticsTable(const StatisticsTable& table, TableFormat format, const TableStyle& style = {});

/// The JSON of that, for who puts it into a larger one.
nlohmann::ordered_json StatisticsTableJson(const StatisticsTable& table);

}  // namespace legopt::client

#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/compare/solves.h"
#include "client/report/reading.h"
#include "legopt/statistics/hypothesis_tests.h"
#include "legopt/statistics/problem_scores.h"
#include "legopt/statistics/profiles.h"

namespace legopt::client {

/// Shift in geometric means of times.
inline constexpr double kShift_ms = 1.0;

/// Statistics of one method, task and initialization. The unit is the problem, with its repetitions averaged. All
/// figures are over the column's complete problems. Times are those of whole solves. Infinite values: too many problems
/// were not solved. nullopt: no problems.
struct CellStatistics {
  int n = 0;                   ///< number of the column's complete problems; 0: the row is omitted
  int missing = 0;             ///< number of problems with a queued, running or cancelled run
  int runs = 0;                ///< number of runs on the n problems
  double solved = 0.0;         ///< sum over problems of the share of solved runs
  statistics::Interval share;  ///< Wilson's 95 % interval of solved / n
  /// Least and largest number of problems that one repetition, hence one seed, solved; nullopt without repetitions.
  std::optional<int> solved_least, solved_most;
  std::optional<double> time_median_ms, time_q95_ms;  ///< over all n problems, unsolved ones at infinity
  std::optional<double> work_median_ms;               ///< over all n problems; nullopt if it was not counted on all
  std::optional<double> cost_median, cost_q95;        ///< over all n problems, unsolved ones at infinity
  /// Solve::tolerance_used of solved runs; nullopt if it is not known of all, or there is none.
  std::optional<double> tolerance_median, tolerance_largest;
  /// Solve::further_starts of reported runs; nullopt if they were not counted in all, or there is none.
  std::optional<double> further_starts_mean;
  std::optional<std::int64_t> further_starts_largest;
  std::optional<double> par10_ms;                ///< mean time, with failed runs at the column's charge
  std::optional<double> ert_ms;                  ///< expected runtime: total time of all runs divided by the
                                                 ///< number of successes
  std::optional<double> common_time_ms;          ///< shifted geometric mean over the problems that all methods solved
  std::optional<double> common_cost;             ///< geometric mean over the problems that all methods solved
  int paired = 0;                                ///< number of problems that this row and the column's reference both
                                                 ///< solved
  std::optional<double> work_ratio;              ///< ratio of work, like time_ratio; nullopt if not counted on all
  std::optional<double> time_ratio, cost_ratio;  ///< ratio to the reference, geometric means over the paired problems
  std::optional<double> mean_rank;  ///< mean rank by the column's measure among the shown rows; failures last
  double cpu_ms = 0.0;
  int reported = 0;
  int contended = 0;  ///< number of reported runs disturbed by other processes
  int stopped = 0;    ///< number of reported runs stopped by a limit of the solver
};

/// Common values of all methods on a task and initialization. Rows without a completed problem are omitted.
struct ColumnStatistics {
  int complete = 0;                   ///< number of problems completed by all shown rows: the n of every figure
  int common = 0;                     ///< number of complete problems solved by all shown rows
  std::vector<std::string> left_out;  ///< titles of the omitted rows
  std::string reference;              ///< title of the row that solved the most problems, the first one if tied; empty:
                                      ///< none
  /// Test over the `complete` problems; nullopt without problems, with fewer than three rows, or with repetitions.
  std::optional<statistics::CochranTest> success;
  bool by_work = false;  ///< ranks and profile use work, because it was counted for all shown rows; else time
  std::optional<statistics::FriedmanTest> ranks;  ///< test of ranks; nullopt without problems or with fewer
                                                  ///< than three rows
  Charge charge;                                  ///< charge of a failed run, equal for all initializations
  statistics::PerformanceProfile
      profile;  ///< profile by the measure over the complete problems; one curve per shown row, in order
};

struct StatisticsRow {
  MethodIdentity method;
  std::string title;  ///< name as in the benchmark table, with "(method ID)" if rows would be indistinguishable
  std::map<BenchmarkColumn, CellStatistics> cells;
};

/// Statistics of an experiment.
struct StatisticsTable {
  ExperimentInfo experiment;
  std::int64_t seed = 0;
  std::int64_t repetitions = 1;
  Rule rule = Rule::kSolid;
  std::map<BenchmarkColumn, ColumnStatistics> columns;
  std::vector<StatisticsRow> rows;  ///< ordered as in the experiment
  std::vector<ResultProvenance> origins;
  std::int64_t clock_stopped = 0, taken_over = 0;  ///< see SolvedExperiment
  std::int64_t jobs = 0, finished = 0;             ///< finished: with a result, failed or dead
};

/// Computes the statistics of an experiment whose solves have been read by the same `rule`. `charge_ms`: see ChargesOf.
StatisticsTable ComputeStatistics(const SolvedExperiment& experiment, Rule rule, std::optional<double> charge_ms = {});

/// Reads an experiment with the solves of the selected cells. Throws the errors of ReadBenchmarkTable.
SolvedExperiment ReadSelectedSolves(ResultSource& source, const TableSelection& selection);

/// Reads an experiment and computes its statistics. Throws the errors of ReadBenchmarkTable.
StatisticsTable ReadStatisticsTable(ResultSource& source, const TableSelection& selection,
                                    std::optional<double> charge_ms = {});

/// Returns "WHAT of experiment 3 'quick', dataset garage, literal rule, seed 1, one run per problem." with builds and
/// machines.
std::string CaptionOf(const std::string& what, const StatisticsTable& table);

/// Returns one table per task and initialization, with times in `unit`; the first has the caption, the last one the
/// explanation of the figures.
std::vector<Table> TablesOf(const StatisticsTable& table, const TimeUnit& unit);

/// Renders the statistics. Text, Markdown and LaTeX: one table per task and initialization. CSV and JSON: all figures
/// unrounded, one row per method, task and initialization, times in ms; infinite or missing values are empty or null.
std::string RenderStatisticsTable(const StatisticsTable& table, TableFormat format, const TableStyle& style = {});

/// Renders the performance profiles as steps for plotting: the share of problems on which a method took at most `ratio`
/// times the best time in the table. There is one row for each step of each method, task and initialization, in
/// ascending order; every curve begins at ratio 1, with share 0 if the method is never the best. Columns:
/// experiment_id, method_id, method, multi_starts, inner_starts, sample_size, incremental, collision, task,
/// initialization, measure (work or time), problems, ratio, share.
std::string RenderProfiles(const StatisticsTable& table, TableFormat format, const TableStyle& style = {});

/// Returns the JSON as an object, to be inserted into a larger one.
nlohmann::ordered_json StatisticsTableJson(const StatisticsTable& table);

}  // namespace legopt::client

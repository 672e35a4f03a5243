#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/compare/charge.h"
#include "client/compare/solves.h"
#include "client/report/reading.h"
#include "legopt/statistics/interval.h"
#include "legopt/statistics/many_methods.h"
#include "legopt/statistics/profiles.h"

namespace legopt::client {

/// The shift of geometric means of times.
inline constexpr double kShift_ms = 1.0;

/// One method on one task from one start. The unit is the problem, its repetitions averaged before. All figures are
/// over the column's complete problems. Times are of whole solves. Infinite: more problems were not solved than that.
/// None: no problem to compute it over.
struct CellStatistics {
  int n = 0;                                          ///< the column's complete problems; 0: the row is left out
  int missing = 0;                                    ///< problems with a run that is queued, running or cancelled
  int runs = 0;                                       ///< on the n problems
  double solved = 0.0;                                ///< sum of the problems' shares of solved runs
  statistics::Interval share;                         ///< Wilson's 95 % interval of solved / n
  std::optional<double> time_median_ms, time_q95_ms;  ///< of all n problems, an unsolved one at infinity
  std::optional<double> cost_median, cost_q95;        ///< likewise
  std::optional<double> par10_ms;                     ///< mean time, a failed run at the column's charge
  std::optional<double> ert_ms;                       ///< time of all runs over the number of successes
  std::optional<double> common_time_ms;          ///< shifted geometric mean over the problems that all methods solved
  std::optional<double> common_cost;             ///< geometric mean over the same
  int paired = 0;                                ///< problems that this row and the column's reference both solved
  std::optional<double> time_ratio, cost_ratio;  ///< to the reference, geometric means over the paired problems
  std::optional<double> mean_rank;               ///< mean rank by time among the shown rows; failures last
  double cpu_ms = 0.0;                           ///< CPU time of all runs
  int reported = 0;                              ///< runs that have a result
  int contended = 0;                             ///< reported runs that others disturbed
  int stopped = 0;                               ///< reported runs that a limit of the solver ended
};

/// A task from a start: what its methods have in common. A row that has completed no problem is left out.
struct ColumnStatistics {
  int complete = 0;                   ///< problems that all shown rows have completed: the n of every figure
  int common = 0;                     ///< complete problems that all shown rows solved
  std::vector<std::string> left_out;  ///< titles of the rows that have completed nothing
  std::string reference;              ///< title of the row that solved the most, the first of equals; empty: none
  /// Of the `complete` problems; none: no problem, fewer than three rows, or several repetitions.
  std::optional<statistics::CochranTest> success;
  std::optional<statistics::FriedmanTest> ranks;  ///< test of ranks by time; none: no problem, or fewer than three rows
  Charge charge;                                  ///< charge of a failed run, the same from every start
  statistics::PerformanceProfile
      profile;  ///< profile by time over the complete problems; a curve for each shown row, in order
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
  Rule rule = Rule::kSolid;
  std::map<BenchmarkColumn, ColumnStatistics> columns;
  std::vector<StatisticsRow> rows;  ///< in the experiment's order
  std::vector<ResultOrigin> origins;
  std::int64_t clock_stopped = 0, taken_over = 0;  ///< as of SolvedExperiment
  std::int64_t jobs = 0, finished = 0;             ///< finished: with a result, failed or dead
};

/// The figures of an experiment whose solves have been read. `rule` as they were; `charge_ms`: as of ChargesOf.
StatisticsTable ComputeStatistics(const SolvedExperiment& experiment, Rule rule, std::optional<double> charge_ms = {});

/// Reads and computes. Errors as of ReadBenchmarkTable.
StatisticsTable ReadStatisticsTable(ResultSource& source, const TableSelection& selection,
                                    std::optional<double> charge_ms = {});

/// "WHAT of experiment 3 'quick', dataset garage, literal rule, seed 1, one run per problem.", builds and machines.
std::string CaptionOf(const std::string& what, const StatisticsTable& table);

/// Text, Markdown and LaTeX: a table for each task and start, CSV and JSON: all figures unrounded, a row for each
/// method, task and start, times in ms; what is infinite or not there is empty or null.
std::string RenderStatisticsTable(const StatisticsTable& table, TableFormat format, const TableStyle& style = {});

/// The performance profiles as steps, for plotting: on which share of the problems a method took at most `ratio` times
/// what the best of the table took there. A row for each step of each method, task and start, in ascending order; every
/// curve begins at ratio 1, with share 0 where the method is the best nowhere. Columns: experiment_id, method_id,
/// method, multi_starts, inner_starts, sample_size, incremental, collision, task, initialization, problems, ratio,
/// share. Throws ClientError (kUsage) for LaTeX.
std::string RenderProfiles(const StatisticsTable& table, TableFormat format, const TextLayout& layout = {});

/// The JSON of that, for who puts it into a larger one.
nlohmann::ordered_json StatisticsTableJson(const StatisticsTable& table);

}  // namespace legopt::client

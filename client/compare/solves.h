#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/report/benchmark_table.h"
#include "client/report/method_choice.h"
#include "client/report/result_filter.h"
#include "client/report/result_source.h"
#include "legopt/statistics/problem_scores.h"
#include "legopt/types/check.h"
#include "legopt/types/result.h"
#include "legopt/types/task.h"

namespace legopt::client {

/// Resolution of the clock: a lower bound for measured times.
inline constexpr double kShortest_ms = 1e-3;

/// Smallest used tolerance in figures with logarithmic axes, where a solution without a violation is placed.
inline constexpr double kLeastTolerance = 1e-8;

/// A job as seen by the statistics.
struct Solve {
  std::int64_t job_id = 0;
  int problem = 0;    ///< problem number in the dataset
  int waypoints = 1;  ///< number of waypoints required by the problem
  statistics::RunOutcome end = statistics::RunOutcome::kMissing;
  /// CPU time of the whole solve; wall time of results without CPU time; the limit without a result.
  double time_ms = 0.0;
  double work_ms = 0.0;  ///< term evaluations, each with the weight of its kind of term; 0: not counted
  double cpu_ms = 0.0;   ///< 0 without a result
  double cost = 0.0;     ///< cost per waypoint, computed by the judge; 0 unless solved
  /// Largest distance (m, rad or vector part of a quaternion) of the solution from constraints with the tolerance
  /// kPoseTolerance, by the judge; nullopt if it is not solved, or of a release that did not store it.
  std::optional<double> tolerance_used;
  std::optional<std::int64_t> further_starts;  ///< initial points beyond the first of each window; nullopt: not counted
  bool reported = false;
  bool contended = false;  ///< other processes disturbed it, see Contended
  bool stopped = false;    ///< a limit stopped the solver
};

/// All jobs of one method, task and initialization.
struct SolveCell {
  std::int64_t cell_id = 0;
  MethodIdentity method;
  BenchmarkColumn column;
  std::int64_t num_jobs = 0;
  double limit_ms = 0.0;        ///< wall-time limit of a job
  bool effort_limited = false;  ///< the jobs also have an effort limit, which is reached long before the wall-time
                                ///< limit
  std::vector<Solve> solves;    ///< ordered by problem, then repetition
};

/// The solves of an experiment; the cells are in the order of its benchmark table.
struct SolvedExperiment {
  ExperimentInfo info;
  std::int64_t seed = 0;
  std::int64_t repetitions = 1;
  std::vector<SolveCell> cells;
  std::vector<ResultProvenance> origins;  ///< builds and machines of its results
  std::int64_t clock_stopped = 0;  ///< number of jobs stopped by the wall-time limit, whose outcome depends on the
                                   ///< machine's speed
  std::int64_t taken_over = 0;     ///< number of results reused from other experiments

  /// Distinct methods.
  std::vector<MethodIdentity> Methods() const;
};

/// Returns whether the wall time of a solve was affected by the machine's load: the thread was interrupted, or waited
/// for a sixth of its time.
bool Contended(std::int64_t wall_us, std::int64_t cpu_us, std::int64_t involuntary_context_switches);

/// Returns whether the solver reported that it was stopped by a limit.
bool EndedByLimit(SolveStatus status);

/// Reads the experiment (default: the newest) and its cells, without their solves. Throws the errors of FindExperiment.
SolvedExperiment ReadCells(ResultSource& source, std::optional<std::int64_t> experiment);

/// Removes the cells that `kept` omits.
void KeepCells(const KeptCells& kept, SolvedExperiment* experiment);

/// Reads the solves of the cells in `experiment`; `rule` counts successes. Throws the errors of RequireVerdicts.
void ReadSolves(ResultSource& source, Rule rule, SolvedExperiment* experiment);

/// A problem of a cell, with its repetitions summed.
struct ProblemRuns {
  int problem = 0;
  int waypoints = 1;
  std::int64_t job_id = 0;                                   ///< first repetition
  statistics::ProblemScore time;                             ///< score of Solve::time_ms
  statistics::ProblemScore work;                             ///< score of Solve::work_ms
  statistics::ProblemScore cost;                             ///< score of Solve::cost
  statistics::ProblemScore tolerance;                        ///< score of Solve::tolerance_used
  bool work_counted = true;                                  ///< the work of all solved repetitions was counted
  bool tolerance_known = true;                               ///< all solved repetitions have Solve::tolerance_used
  std::vector<statistics::Repetition> runs;                  ///< values of Solve::time_ms
  std::vector<statistics::Repetition> work_runs, cost_runs;  ///< values of Solve::work_ms and Solve::cost
  std::vector<statistics::Repetition> tolerance_runs;        ///< values of Solve::tolerance_used, from kLeastTolerance

  /// Returns whether every repetition has ended.
  bool complete() const { return time.finished() > 0 && time.missing == 0; }
};

/// Returns the problems of a cell, ascending.
std::vector<ProblemRuns> ProblemsOf(const SolveCell& cell);

/// Problems of a cell by problem number.
using ProblemMap = std::map<int, ProblemRuns>;
ProblemMap ProblemMapOf(const SolveCell& cell);

/// Methods and problems that can be compared while an experiment is unfinished. Easy jobs tend to end first, so figures
/// of all methods are computed over the same problems.
struct CompleteProblems {
  std::vector<bool> shown;    ///< whether a method has completed a problem; other methods have no figures
  std::vector<int> problems;  ///< completed by all shown methods, ascending
};

/// Finds the complete problems of the methods of one task and initialization.
CompleteProblems FindCompleteProblems(std::span<const ProblemMap> methods);

/// The factor of PAR10: a failed run is charged this multiple of the limit.
inline constexpr double kPenaltyFactor = 10.0;

/// Time limit per waypoint used for the charge if the solver is limited by effort instead of wall time. It does not
/// depend on the shown methods, so figures do not change when a method is added.
inline constexpr double kLimitPerWaypoint_ms = 1000.0;

/// Source of a charge.
enum class ChargeRule : std::uint8_t {
  kChosen,       ///< set by --charge
  kPerWaypoint,  ///< ten times kLimitPerWaypoint_ms for each waypoint of the problem
  kWallLimit     ///< ten times the wall-time limit, if it is the only limit
};

/// Time charged for a failed run in mean times.
struct Charge {
  double ms = 0.0;  ///< milliseconds per run; per waypoint with kPerWaypoint
  ChargeRule rule = ChargeRule::kWallLimit;

  /// Returns the mean time of a problem's finished runs, with failed runs at the charge.
  double Apply(const ProblemRuns& problem) const;
};

/// Returns the charge of each task for cells that are shown or compared together. `chosen_ms` (> 0) is used unchanged.
/// With kWallLimit the smallest limit is used. 0 for tasks without cells.
EnumArray<Task, Charge> ChargesOf(std::span<const SolveCell> cells, std::optional<double> chosen_ms);

/// Returns e.g. "10.0 s for each waypoint of the problem", "3.00 s, as chosen" for captions, in `unit`.
std::string DescribeCharge(const Charge& charge, const TimeUnit& unit);

/// Returns "chosen", "per_waypoint" or "wall_limit".
const char* EnumNameOf(ChargeRule rule);

/// Returns "PAR10", or "Charged" if the charge was chosen.
const char* TitleOfChargedMean(ChargeRule rule);

}  // namespace legopt::client

#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/report/benchmark_table.h"
#include "client/report/result_origins.h"
#include "client/report/result_source.h"
#include "legopt/statistics/problem_scores.h"
#include "words/collision.h"
#include "words/result.h"

namespace legopt::client {

/// A method of an experiment, with all that tells it from others of its name.
struct MethodIdentity {
  std::int64_t method_id = 0;
  std::string name;
  std::int64_t multi_starts = 0;
  std::int64_t inner_starts = 0;   ///< that an attempt may make beyond its first one
  std::int64_t sample_size = 100;  ///< percent
  bool incremental = false;
  SceneRepresentation collision = SceneRepresentation::kSolid;
  std::string hash;  ///< of all options

  /// Equal options under an equal name, also in another database.
  bool Same(const MethodIdentity& other) const { return name == other.name && hash == other.hash; }
};

/// The clock's own resolution: a solve that took nothing took less than this.
inline constexpr double kShortest_ms = 1e-3;

/// One job, as statistics see it.
struct Solve {
  std::int64_t job_id = 0;
  int problem = 0;    ///< its number in the dataset
  int waypoints = 1;  ///< number of waypoints that the problem asks for
  statistics::RunEnd end = statistics::RunEnd::kMissing;
  double time_ms = 0.0;    ///< of the whole solve: wall time, CPU time where contended; its limit without a result
  double cpu_ms = 0.0;     ///< 0 without a result
  double cost = 0.0;       ///< per waypoint, by the judge; 0 unless solved
  bool reported = false;   ///< has a result
  bool contended = false;  ///< others had its processor: see Contended
  bool stopped = false;    ///< a limit ended the solver
};

/// All jobs of one method on one task from one start.
struct SolveCell {
  std::int64_t cell_id = 0;
  MethodIdentity method;
  BenchmarkColumn column;
  double limit_ms = 0.0;        ///< wall time that one job may take
  bool effort_limited = false;  ///< its jobs have a limit of effort, too, which ends solves long before
  std::vector<Solve> solves;    ///< by problem, then repetition
};

/// What an experiment has solved; the cells in the order of its benchmark table.
struct SolvedExperiment {
  ExperimentInfo info;
  std::int64_t seed = 0;
  std::int64_t repetitions = 1;
  std::vector<SolveCell> cells;
  std::vector<ResultOrigin> origins;  ///< builds and machines of its results
  std::int64_t clock_stopped = 0;     ///< jobs that the clock ended: their outcome depends on the machine's speed
  std::int64_t taken_over = 0;        ///< results that jobs of other experiments made

  /// Its methods, each once.
  std::vector<MethodIdentity> Methods() const;
};

/// Whether the wall time of a solve tells of the machine rather than of the method: the thread was interrupted, or
/// waited for a sixth of its time.
bool Contended(std::int64_t wall_us, std::int64_t cpu_us, std::int64_t involuntary_context_switches);

/// Whether the solver's word is that it ran out of something rather than that it was done.
bool EndedByLimit(SolveStatus status);

/// The experiment (default: the newest) and its cells, without their solves. Errors as of FindExperiment.
SolvedExperiment ReadCells(ResultSource& source, std::optional<std::int64_t> experiment);

/// Reads the solves of the cells that are left in `experiment`; `rule` says whose success counts. Errors as of
/// RequireVerdicts.
void ReadSolves(ResultSource& source, Rule rule, SolvedExperiment* experiment);

/// One problem of a cell, its repetitions added up.
struct ProblemRuns {
  int problem = 0;
  int waypoints = 1;
  std::int64_t job_id = 0;                   ///< its first repetition
  statistics::ProblemScore time;             ///< of Solve::time_ms
  statistics::ProblemScore cost;             ///< of Solve::cost
  std::vector<statistics::Repetition> runs;  ///< of Solve::time_ms

  /// Whether every repetition has ended.
  bool complete() const { return time.finished() > 0 && time.missing == 0; }
};

/// The problems of a cell, ascending.
std::vector<ProblemRuns> ProblemsOf(const SolveCell& cell);

/// The problems of a cell by their number.
using ProblemMap = std::map<int, ProblemRuns>;
ProblemMap ProblemMapOf(const SolveCell& cell);

/// Which figures can be compared while an experiment is unfinished. The jobs that end first are the easy ones, so that
/// every figure is computed over the same problems for all methods.
struct CompleteProblems {
  std::vector<bool> shown;    ///< whether a method has completed a problem; the others have no figures
  std::vector<int> problems;  ///< that all shown methods have completed, ascending
};

/// Of the methods of one task and start.
CompleteProblems FindCompleteProblems(std::span<const ProblemMap> methods);

}  // namespace legopt::client

#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/report/listing.h"
#include "client/report/result_source.h"
#include "legopt/planning/job_runner.h"
#include "legopt/solvers/solver.h"
#include "legopt/types/check.h"
#include "legopt/types/result.h"

namespace legopt::client {

/// The stored convergence of a job's solve.
struct StoredTrace {
  std::vector<IterationRecord> records;  ///< empty: see `history`
  /// Trace of results made before schema version 7: a row per penalty value, with the columns of that version.
  Listing history;
};

/// Decodes the records in column "trace" of the first row; empty for NULL or an empty BLOB. Throws ClientError
/// (kDatabaseUnusable) if they cannot be decoded.
std::vector<IterationRecord> TraceRecords(const Listing& row, std::int64_t job);

/// Reads the trace of a job. Throws ClientError: kUsage if the job does not exist or has no result or no trace,
/// kDatabaseUnusable if the trace is damaged.
StoredTrace ReadTrace(ResultSource& source, std::int64_t job);

/// Returns one row per record: step, window, restart, start, penalty, trust_box, accepted, evaluations, elapsed_us,
/// cost, violation.
Listing TraceListing(const std::vector<IterationRecord>& records);

/// All inputs of a job and its result, read from the database.
struct StoredJob {
  std::int64_t job_id = 0;
  std::int64_t experiment_id = 0;
  Job job;  ///< its method is parsed from the stored options and has the stored hash
  std::string dataset_name, dataset_hash;
  std::string build_id;  ///< build that made the result; empty if unknown

  SolveStatus status = SolveStatus::kNotRun;
  Verdict literal = Verdict::kWrongWaypointCount, strict = Verdict::kWrongWaypointCount;
  std::optional<Verdict> solid;     ///< nullopt: judged before schema version 7
  std::optional<Verdict> physical;  ///< nullopt: judged before schema version 14
  std::int64_t iterations = 0, restarts = 0;
  std::optional<std::int64_t> starts, term_evaluations, collision_queries, work_ns;  ///< nullopt: not counted
  std::optional<double> margin_relaxed;                                              ///< nullopt: unknown
  std::optional<double> solver_cost, solver_violation, cost;                         ///< nullopt: not finite
  std::vector<Eigen::VectorXd> waypoints;
  std::vector<Eigen::VectorXd> unsolved;  ///< best point of the unsolved window; empty if none is stored
  std::vector<IterationRecord> trace;     ///< convergence; empty: not recorded, or before schema version 7
};

/// Reads a job that has a result by a solver of `registry`. Throws ClientError (kUsage) if the job does not exist or
/// has no result, if it was stopped by the wall-time limit or a user (its result is then not reproducible), if its
/// solver is not in the registry, or if this build interprets its options differently.
StoredJob ReadStoredJob(ResultSource& source, std::int64_t job_id, const SolverRegistry& registry);

/// Returns the ids of `count` replayable jobs of an experiment (fewer if there are fewer), ascending. `cell_ids`: cells
/// to choose from; empty: all. The jobs are chosen randomly such that methods, tasks and initializations are
/// represented evenly. Deterministic for a given seed.
std::vector<std::int64_t> DrawJobs(ResultSource& source, std::int64_t experiment_id,
                                   const std::vector<std::int64_t>& cell_ids, int count, std::uint64_t seed);

/// Returns e.g. "SQP, posture 3 from good, repetition 0, seed 1".
std::string Described(const StoredJob& stored);

}  // namespace legopt::client

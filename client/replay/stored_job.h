#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/report/result_source.h"
#include "legopt/solve/job_runner.h"
#include "words/result.h"

namespace legopt::client {

/// All that decides the result of a job, and that result, as the database has them.
struct StoredJob {
  std::int64_t job_id = 0;
  std::int64_t experiment_id = 0;
  Job job;  ///< its method has been read from the stored options, and has the stored hash
  std::string dataset_name, dataset_hash;
  std::string build_id;  ///< that made the result; empty: not known

  SolveStatus status = SolveStatus::kNotRun;
  Verdict literal = Verdict::kWrongWaypointCount, strict = Verdict::kWrongWaypointCount;
  std::optional<Verdict> solid;  ///< none: judged before schema version 7
  std::int64_t iterations = 0, restarts = 0;
  std::optional<std::int64_t> starts, term_evaluations, collision_queries;  ///< none: not counted
  std::optional<double> solver_cost, solver_violation, cost;                ///< none: not finite
  std::vector<Eigen::VectorXd> waypoints;                                   ///< the solution
  std::vector<Eigen::VectorXd> unsolved;  ///< best point of the window that was not solved; empty: none is stored
  std::vector<IterationRecord> trace;     ///< how it converged; empty: not recorded, or before schema version 7
};

/// Reads a job that has a result, by a solver of `registry`. Throws ClientError (kUsage): there is no such job, it has
/// no result, the clock or a user ended it, so that its bits follow from nothing that is stored, its solver is another,
/// or this build reads its options otherwise.
StoredJob ReadStoredJob(ResultSource& source, std::int64_t job_id, const SolverRegistry& registry);

/// The ids of `count` jobs of an experiment (fewer where it has fewer) that can be replayed, drawn at random, so that
/// every method, task and start has its turn before one has a second. The same for equal seeds. Ascending.
std::vector<std::int64_t> DrawJobs(ResultSource& source, std::int64_t experiment_id, int count, std::uint64_t seed);

/// "SQP, posture 3 from good, repetition 0, seed 1".
std::string Described(const StoredJob& stored);

}  // namespace legopt::client

#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "legopt/types/job.h"
#include "legopt/types/reply.h"
#include "legopt_msg/lease.hpp"
#include "legopt_msg/result_request.hpp"
#include "tests/simulation/disk.h"

namespace legopt::simulation {

/// Record of the actions of clients and workers and the replies to them, which the checker compares with the database.
/// Immediately visible faults are added to `violations`.
class Record {
 public:
  using ResultKey = std::tuple<std::int64_t, int, std::int64_t>;  ///< job, attempt, token

  struct Submission {
    std::int64_t num_jobs = 0;
    std::optional<std::int64_t> experiment_id;  ///< acknowledged number
  };
  struct Report {
    ReportedOutcome outcome{};
    double cost = 0;
    std::set<ResultStatus> answers;  ///< answers that were received
  };

  void Violation(std::string what) { violations.push_back(std::move(what)); }

  // Events of clients.
  void OnSubmit(const std::string& submission_id, std::int64_t num_jobs) {
    submissions[submission_id].num_jobs = num_jobs;
  }
  void OnSubmitted(const std::string& submission_id, std::int64_t experiment_id, std::int64_t num_jobs);
  /// Records the reply that no job of the experiment is leased any more or, with `now`, that none is running.
  void OnStopped(std::int64_t experiment_id, bool now, const StoredState& state);
  /// Records that the experiment is about to be resumed.
  void OnResume(std::int64_t experiment_id, const StoredState& state);
  void OnCancelled(std::int64_t experiment_id, const StoredState& state);
  void OnDeleted(std::int64_t experiment_id, const StoredState& state);

  // Event of the server: these operations are on disk.
  void OnCommit(std::span<const db::StoreOp> operations);

  // Events of workers. `life` identifies one process of one worker.
  void OnLease(const legopt_msg::lease& lease);
  void OnRun(std::uint64_t life, std::int64_t job_id);
  void OnRunEnded(std::uint64_t life, std::int64_t job_id);
  /// Excuses a paused worker, which cannot stop its jobs: they may run in parallel with others.
  void ExcusePausedWorker(std::uint64_t life);
  void OnReport(const legopt_msg::result_request& request);
  void OnAnswer(const legopt_msg::result_request& request, ResultStatus status);

  std::map<std::string, Submission> submissions;
  /// Returns whether deletion was requested for the experiment of a job or of a submission, so that its data may be
  /// missing.
  bool MayBeDeleted(std::int64_t job_id) const;
  bool MayBeDeleted(const std::string& submission_id) const;

  std::set<std::int64_t> cancel_asked, delete_asked, time_limit_retried;  ///< experiments
  std::map<std::int64_t, std::int64_t> results_at_cancel;  ///< experiment -> accepted results at the reply "cancelled"
  std::map<std::int64_t, std::int64_t> attempts_at_stop;   ///< experiment -> attempts at the reply that it is stopped
  std::map<std::int64_t, std::pair<std::int64_t, int>> leases;  ///< token -> job, attempt
  std::map<ResultKey, Report> reports;
  std::vector<std::string> violations;

 private:
  std::map<std::int64_t, std::map<std::uint64_t, bool>> running_;  ///< job -> life -> excused
  std::map<std::int64_t, int> slots_;                              ///< slots of workers, by id
  std::map<std::int64_t, std::int64_t> first_jobs_;                ///< first job of every experiment so far ->
                                                                   ///< experiment
  std::map<AttemptKey, std::int64_t> workers_;                     ///< workers of attempts, by id
};

/// Returns the numbers of results and attempts of an experiment.
std::int64_t AcceptedOf(const StoredState& state, std::int64_t experiment_id);
std::int64_t AttemptsOf(const StoredState& state, std::int64_t experiment_id);

}  // namespace legopt::simulation

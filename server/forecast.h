#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "legopt/types/task.h"
#include "server/scheduler.h"

namespace legopt::server {

/// Jobs of one kind (a cell of the benchmark table: method, task, initialization) and their durations so far. Durations
/// are measured per waypoint of the problem, because long motions take longer than short ones.
struct JobKind {
  std::size_t method = 0;
  Task task{};
  double seconds = 0;    ///< total wall time of the solves that produced a result
  double waypoints = 0;  ///< number of waypoints in these problems; 0: no job of this kind has ended
};

/// A job that is running in a slot.
struct RunningWork {
  std::size_t kind = 0;
  double waypoints = 1;    ///< number of waypoints of its problem, >= 1
  double elapsed_s = 0;    ///< time since it was leased, >= 0
  int windows_solved = 0;  ///< number of solved windows of a motion, as reported by its worker
  int windows = 0;         ///< total number of windows, >= windows_solved; 0: none or unknown
  double limit_s = 0;      ///< wall-time limit, > 0
};

/// Identical queued jobs.
struct QueuedWork {
  std::size_t kind = 0;
  double waypoints = 1;  ///< number of waypoints of each problem, >= 1
  std::int64_t count = 0;
};

/// Remaining work of an experiment.
struct WorkLeft {
  std::vector<JobKind> kinds;
  std::vector<RunningWork> running;
  std::vector<QueuedWork> queued;  ///< sorted by task, in the order in which tasks start, then by
                                   ///< method, although methods take turns
  double slots = 0;                ///< average number of slots that will work on it; fractional if slots are shared
};

/// Returns the seconds per waypoint of each kind:
///
///     (sum of seconds) / (sum of waypoints)
///
/// The sums are taken over its results and the finished windows of its running jobs; on average, half of the current
/// window is done. A running job without windows contributes only the time beyond the estimate from the other jobs,
/// because the jobs that finish first are the short ones. A kind without results uses the same method and task with the
/// other initialization. An element is nullopt until a job of its method and task has ended; times of other methods are
/// not used.
std::vector<std::optional<double>> SecondsPerWaypoint(const WorkLeft& left);

/// Returns the seconds until the last job ends if `left.slots` continue to work on the experiment: first the running
/// jobs, then the queued jobs in order, each in the next free slot. Thus a single long job is not divided by the number
/// of slots, and long jobs at the end count in full. Returns nullopt if no job is running, without slots, or if no job
/// has ended for the method and task of a kind with remaining jobs.
///
/// A running motion is extrapolated from its progress, with more weight the further it is; another job is expected to
/// take the time of its kind. A job that has exceeded its expected time is expected to need another quarter of its
/// elapsed time, within its time limit.
std::optional<double> EstimateRemaining_s(const WorkLeft& left);

/// Expected course of an active experiment.
struct ExperimentForecast {
  std::string waiting_for;            ///< why it stalls, for display; empty while it progresses
  std::optional<double> remaining_s;  ///< estimated time until its end; nullopt while it stalls
  double share = 0;                   ///< share of the busy slots that work on it, [0, 1]
  WorkLeft left;
  /// Requirements of its queued jobs that no worker satisfies, for display: "no worker has solver 'mine' (6b4f8a0d)".
  std::vector<std::string> missing;
};

/// A snapshot of all experiments of a scheduler at one time. Experiments that are finished or no longer in memory have
/// an empty Outlook.
///
/// An experiment progresses while a slot runs one of its jobs on a worker with recent messages. Of the jobs leased to a
/// worker, its slots run those leased first. If nothing progresses, the reason is the first of these that applies: the
/// database cannot be written; the experiment is paused; the server is stopping; no worker is connected;
/// workers are still loading; no worker satisfies the requirements; no recent message from suitable workers or from
/// workers with its jobs; the workers work on other experiments.
///
/// Thread rule: the scheduler's thread. The scheduler must not change during the lifetime of this object.
class ForecastSnapshot {
 public:
  /// `store_error`: why the database cannot be written; empty if it can.
  ForecastSnapshot(const Scheduler& scheduler, const Instant& now, std::string store_error);

  ExperimentForecast Of(std::int64_t experiment_id) const;
  /// Returns why an active experiment stalls although the workers do not work on others instead; empty if it
  /// progresses, waits for its turn, or is finished. Cheaper than Of.
  std::string StallReason(std::int64_t experiment_id) const;

 private:
  using Leases = std::vector<LeaseView>;

  bool IsResponsive(const WorkerStatus& worker) const;
  /// Returns whether the worker is online and satisfies the requirements of its jobs.
  bool IsSuitable(const WorkerStatus& worker, const Experiment& experiment) const;
  std::string WaitingFor(const db::ExperimentSummary& summary, const Experiment& experiment) const;
  std::string WaitingForWorkers(const Experiment& experiment) const;
  std::vector<std::string> Missing(const Experiment& experiment) const;
  std::string MissingFor(const Experiment& experiment, const Experiment::Group& group) const;
  std::string OccupyingExperiments(const Experiment& experiment) const;
  WorkLeft Left(const Experiment& experiment) const;
  double SlotsFor(const Experiment& experiment) const;
  bool CompetesForSlots(const db::ExperimentSummary& summary) const;

  const Scheduler& scheduler_;
  Instant now_;
  std::string store_error_;
  std::map<std::int64_t, WorkerStatus> workers_;  // key: worker id
  std::map<std::int64_t, Leases> worked_on_;      // running leases of workers with recent messages; key: experiment
  std::set<std::int64_t> waiting_for_silent_workers_;  // experiments with leases of workers without recent messages
  std::size_t busy_slots_ = 0;
};

}  // namespace legopt::server

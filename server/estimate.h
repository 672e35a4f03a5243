#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "legopt/types/task.h"

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
  std::vector<QueuedWork> queued;  ///< sorted by execution order
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

}  // namespace legopt::server

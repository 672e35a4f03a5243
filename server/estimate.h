#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "words/task.h"

namespace legopt::server {

/// Jobs of one kind (a cell of the benchmark table: method, task, initialisation) and how long they took so far.
/// Durations are counted per waypoint of the problem, so that a long motion is more work than a short one.
struct JobKind {
  std::size_t method = 0;
  Task task{};
  double seconds = 0;    ///< wall time of the solves that gave a result
  double waypoints = 0;  ///< waypoints of their problems; 0: no job of this kind has ended
};

/// A job that a slot works on.
struct RunningWork {
  std::size_t kind = 0;
  double waypoints = 1;    ///< of its problem, >= 1
  double elapsed_s = 0;    ///< since it was leased, >= 0
  int windows_solved = 0;  ///< of a motion, as told by its worker
  int windows = 0;         ///< that it has, >= windows_solved; 0: none, or not told
  double limit_s = 0;      ///< its wall-time limit, > 0
};

/// Jobs that wait, alike.
struct QueuedWork {
  std::size_t kind = 0;
  double waypoints = 1;  ///< of the problem of each, >= 1
  std::int64_t count = 0;
};

/// All that is left of an experiment.
struct WorkLeft {
  std::vector<JobKind> kinds;
  std::vector<RunningWork> running;
  std::vector<QueuedWork> queued;  ///< in the order of work
  double slots = 0;                ///< that will work on it, on average; a fraction where it shares them
};

/// Seconds per waypoint of each kind:
///
///     (sum of seconds) / (sum of waypoints)
///
/// over its results and the parts that its running jobs have done, by windows; half of the window under way is done, on
/// average. A running job without a window adds the time beyond what the others let expect: those that are done first
/// are the short ones. A kind without a result borrows from the same method and task with the other initialisation.
/// Empty as long as no job of that method and task has ended: the time of a method does not follow from that of others.
std::vector<std::optional<double>> SecondsPerWaypoint(const WorkLeft& left);

/// Seconds until the last job ends, if `left.slots` go on with it: the running jobs, then the queued ones in their
/// order, each by the next slot that is free. So a single long job is not divided by the slots, and long jobs at the
/// end count in full. Empty when nothing runs, without slots, or when no job of the method and task of a kind with jobs
/// left has ended.
///
/// A running motion is expected to go on as it did, the more so the further it is; another job to take what its kind
/// takes. One that has taken longer is expected to take a quarter more of what it took, within its time limit.
std::optional<double> EstimateRemaining_s(const WorkLeft& left);

}  // namespace legopt::server

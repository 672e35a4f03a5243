#pragma once

#include <string>
#include <vector>

#include "server/forecast.h"

namespace legopt::server {

/// A job of a recorded run.
struct RecordedJob {
  std::size_t kind = 0;
  double waypoints = 1;
  double wall_s = 0;
  int windows = 0;  ///< windows of a motion; 0: none
};

/// A run with its jobs in the order of execution.
struct RecordedHistory {
  std::vector<JobKind> kinds;  ///< without times
  std::vector<RecordedJob> jobs;
};

/// Reads tests/server/histories/FILE: lines "method,task,initialization,waypoints,wall_us,windows" after a header.
/// Throws std::runtime_error.
RecordedHistory ReadHistory(const std::string& file);

/// Start and end of a recorded job.
struct ReplayedJob {
  double begin_s = 0, end_s = 0;
};

/// Assigns each job to the slot that is free first.
std::vector<ReplayedJob> AssignToSlots(const std::vector<RecordedJob>& jobs, int slots);

/// Returns the server's knowledge at `now_s`. Windows of a motion are solved at an even pace.
WorkLeft RemainingWorkAt(const RecordedHistory& history, const std::vector<ReplayedJob>& jobs, double now_s, int slots);

}  // namespace legopt::server

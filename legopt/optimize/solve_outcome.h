#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "words/result.h"

namespace legopt {

/// One trial step of an optimiser. Of the records of one solve the last accepted one is the returned point; when none
/// is accepted, the start is returned.
struct IterationRecord {
  int window = 0;
  int restart = 0;
  double penalty = 0.0;    ///< mu; 0 for methods without
  double trust_box = 0.0;  ///< half width; 0 for methods without
  double cost = 0.0;       ///< F at the trial point
  double violation = 0.0;  ///< largest single constraint violation at the trial point
  bool accepted = false;
};

/// What a solve of one problem, restarts included, produced.
struct SolveOutcome {
  SolveStatus status = SolveStatus::kNotRun;
  std::vector<Eigen::VectorXd> waypoints;  ///< n + 7 each; the best point found; of a motion what was solved
  double cost = 0.0;                       ///< optimiser's own cost of the returned point
  double max_violation = 0.0;              ///< largest single constraint violation of the returned point
  int iterations = 0;                      ///< trial steps of all attempts
  int restarts = 0;                        ///< attempts beyond the first, of all windows
  int windows = 0;                         ///< of a motion; 0 for a posture
  int windows_solved = 0;                  ///< the first ones; `waypoints` are theirs
  std::int64_t wall_us = 0;                ///< of the solving thread, restarts included, loading excluded
  std::int64_t cpu_us = 0;                 ///< CPU time of the solving thread
  std::int64_t involuntary_context_switches = 0;
  std::vector<IterationRecord> history;
  std::string message;  ///< for humans: what failed, or empty
};

}  // namespace legopt

#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "legopt/types/check.h"

namespace legopt {

/// A path in time through the waypoints of a motion: a solution of a continuous task
/// (docs/explanation/judge.md#continuous-motions). Points are connected by the interpolation of robot/interpolation.h.
///
/// In files, messages and databases a point is n + 8 numbers: a configuration (n + 7), then its time stamp. Time is
/// measured in segments: waypoint w is the point at time w.
struct TimedPath {
  std::vector<Eigen::VectorXd> points;  ///< configurations, n + 7 each
  std::vector<double> times;            ///< time of each point, increasing from 0
  std::vector<std::size_t> waypoints;   ///< point indices of waypoints 0, 1, ...; the last one is the last point
};

/// A fault in the numbers of a path.
struct PathDiagnostic {
  Verdict verdict{};   ///< wrong number of waypoints; wrong size, also for misplaced time stamps; not finite
  int waypoint = -1;   ///< waypoint at or before the fault; -1: the whole path
  std::string detail;  ///< the point, and the expected value
};

/// Parses `points` (n + 8 numbers each, see TimedPath) of a motion with `num_waypoints` >= 2. Time stamps must start at
/// 0, increase, contain the time of every waypoint exactly and end at the last one. Each segment may have at most
/// kMaxPieces pieces. `path` is complete if no fault is returned.
std::optional<PathDiagnostic> ParsePath(std::span<const Eigen::VectorXd> points, int num_waypoints,
                                        int configuration_size, TimedPath* path);

/// Builds the path through waypoints and intermediate points: `ways` has the points of each segment, at equal intervals
/// in time.
TimedPath MakePath(std::span<const Eigen::VectorXd> waypoints, std::span<const std::vector<Eigen::VectorXd>> ways);

/// Returns the points of a path in their stored form.
std::vector<Eigen::VectorXd> FormatPath(const TimedPath& path);

}  // namespace legopt

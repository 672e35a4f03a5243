#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "words/result.h"

namespace legopt {

/// A path in time through the waypoints of a motion: a solution of the continuous tasks
/// (docs/readings.md#continuous-motions). It leads from point to point as robot/interpolation.h does.
///
/// In files, messages and databases a point is n + 8 numbers: a configuration (n + 7), then its time stamp, in steps
/// from waypoint to waypoint: waypoint w is the point at time w.
struct TimedPath {
  std::vector<Eigen::VectorXd> points;  ///< configurations, n + 7 each
  std::vector<double> times;            ///< as many, increasing from 0
  std::vector<std::size_t> waypoints;   ///< the points that are waypoints 0, 1, ...; the last one is the last point
};

/// What is wrong with the numbers of a path.
struct PathFault {
  Verdict verdict{};   ///< wrong count of waypoints; wrong size, also of time stamps out of place; not finite
  int waypoint = -1;   ///< at or before which; -1: the whole path
  std::string detail;  ///< which point, and what it should be
};

/// Takes `points` (n + 8 numbers each, as above) of a motion of `num_waypoints` >= 2 apart. Time stamps begin at 0,
/// increase, meet every waypoint exactly, end at the last one and cut the way from one waypoint to the next into at
/// most kMostPieces. `path` is complete when there is no fault.
std::optional<PathFault> TakeApart(std::span<const Eigen::VectorXd> points, int num_waypoints, int configuration_size,
                                   TimedPath* path);

/// The path through waypoints and what is between them: `ways` has the points from each to the next, at equal distances
/// in time.
TimedPath PathThrough(std::span<const Eigen::VectorXd> waypoints, std::span<const std::vector<Eigen::VectorXd>> ways);

/// The points of a path as they are stored.
std::vector<Eigen::VectorXd> PutTogether(const TimedPath& path);

}  // namespace legopt

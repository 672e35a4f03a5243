#include "legopt/judge/timed_path.h"

#include <cmath>

#include "legopt/judge/diagnostic_text.h"
#include "legopt/types/task.h"

namespace legopt {
namespace {

std::string PointAt(std::size_t i, double time) {
  return "point " + std::to_string(i) + " (time " + NumberText(time) + ")";
}

PathDiagnostic MakeTimeStampDiagnostic(int waypoint, const std::string& detail) {
  return {Verdict::kWrongSize, waypoint, detail};
}

/// Checks sizes and numbers of time stamps; the judge checks the configurations.
std::optional<PathDiagnostic> CheckPathNumbers(std::span<const Eigen::VectorXd> points, int configuration_size) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (points[i].size() != configuration_size + 1) {
      return PathDiagnostic{Verdict::kWrongSize, -1,
                            "point " + std::to_string(i) + " has " + std::to_string(points[i].size()) +
                                " numbers instead of " + std::to_string(configuration_size + 1) +
                                ", a configuration and its time stamp"};
    }
    if (!std::isfinite(points[i][configuration_size])) {
      return PathDiagnostic{Verdict::kNotFinite, -1, "the time stamp of point " + std::to_string(i) + " is not finite"};
    }
  }
  return std::nullopt;
}

/// Checks the time stamp of point i; `before` is that of the previous point.
std::optional<PathDiagnostic> CheckTimeStamp(std::size_t i, double time, double before, int pieces) {
  const int waypoint = static_cast<int>(std::floor(before));
  if (!(time > before)) {
    return MakeTimeStampDiagnostic(
        waypoint, PointAt(i, time) + " is not later than the point before it, at " + NumberText(before));
  }
  const double next = waypoint + 1.0;
  if (time > next) {
    return MakeTimeStampDiagnostic(waypoint, "no point at waypoint " + std::to_string(waypoint + 1) + ": " +
                                                 PointAt(i, time) + " follows that at " + NumberText(before));
  }
  if (pieces > kMaxPieces) {
    return MakeTimeStampDiagnostic(waypoint, "more than " + std::to_string(kMaxPieces) + " pieces from waypoint " +
                                                 std::to_string(waypoint) + " to the next: " + PointAt(i, time));
  }
  return std::nullopt;
}

}  // namespace

std::optional<PathDiagnostic> ParsePath(std::span<const Eigen::VectorXd> points, int num_waypoints,
                                        int configuration_size, TimedPath* path) {
  *path = {};
  if (auto fault = CheckPathNumbers(points, configuration_size)) return fault;
  int pieces = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double time = points[i][configuration_size];
    if (i == 0 && time != 0.0) return MakeTimeStampDiagnostic(0, PointAt(0, time) + " is the first and not at time 0");
    ++pieces;
    if (i > 0) {
      if (auto fault = CheckTimeStamp(i, time, path->times.back(), pieces)) return fault;
    }
    if (time == std::floor(time)) {
      path->waypoints.push_back(i);
      pieces = 0;
    }
    path->points.emplace_back(points[i].head(configuration_size));
    path->times.push_back(time);
  }
  if (!points.empty() && path->waypoints.back() + 1 != points.size()) {
    return MakeTimeStampDiagnostic(static_cast<int>(path->waypoints.size()) - 1,
                                   PointAt(points.size() - 1, path->times.back()) + " is the last and no waypoint");
  }
  if (std::ssize(path->waypoints) != num_waypoints) {
    return PathDiagnostic{
        Verdict::kWrongWaypointCount, -1,
        std::to_string(path->waypoints.size()) + " waypoints instead of " + std::to_string(num_waypoints)};
  }
  return std::nullopt;
}

TimedPath MakePath(std::span<const Eigen::VectorXd> waypoints, std::span<const std::vector<Eigen::VectorXd>> ways) {
  TimedPath path;
  const auto keep = [&path](const Eigen::VectorXd& point, double time) {
    path.points.push_back(point);
    path.times.push_back(time);
  };
  for (std::size_t w = 0; w < waypoints.size(); ++w) {
    const auto time = static_cast<double>(w);
    keep(waypoints[w], time);
    if (w == ways.size()) break;
    const double pieces = static_cast<double>(ways[w].size()) + 1.0;
    for (std::size_t k = 0; k < ways[w].size(); ++k) keep(ways[w][k], time + static_cast<double>(k + 1) / pieces);
  }
  return path;
}

std::vector<Eigen::VectorXd> FormatPath(const TimedPath& path) {
  std::vector<Eigen::VectorXd> points;
  for (std::size_t i = 0; i < path.points.size(); ++i) {
    Eigen::VectorXd& point = points.emplace_back(path.points[i].size() + 1);
    point << path.points[i], path.times[i];
  }
  return points;
}

}  // namespace legopt

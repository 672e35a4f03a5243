#include "legopt/planning/internal/curve_faults.h"

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>

#include "legopt/dynamics/path_spline.h"

namespace legopt {
namespace {

/// Samples of each piece of the spline.
constexpr int kSamplesPerPiece = 4;
/// How far a joint may be beyond its limit between points, rad or m: most of the judge's tolerance.
constexpr double kLargestExcess = 7e-4;

/// Returns the points of the spline on segment w, both ends included.
std::vector<Eigen::VectorXd> SamplesOf(const PathSpline& spline, const TimedPath& path, std::size_t w) {
  std::vector<Eigen::VectorXd> samples;
  CurvePoint point;
  for (std::size_t i = path.waypoints[w]; i < path.waypoints[w + 1]; ++i) {
    for (int k = 0; k < kSamplesPerPiece; ++k) {
      const double share = static_cast<double>(k) / kSamplesPerPiece;
      spline.Evaluate(path.times[i] + share * (path.times[i + 1] - path.times[i]), &point);
      samples.push_back(point.x);
    }
  }
  spline.Evaluate(path.times[path.waypoints[w + 1]], &point);
  samples.push_back(point.x);
  return samples;
}

/// Returns the first joint beyond its limits; empty if there is none.
std::string JointBeyondLimits(const RobotModel& robot, const std::vector<Eigen::VectorXd>& samples) {
  const Eigen::Index n = robot.num_dofs();
  for (const Eigen::VectorXd& x : samples) {
    const Eigen::ArrayXd beyond = (robot.lower_limits() - x.head(n)).cwiseMax(x.head(n) - robot.upper_limits()).array();
    for (Eigen::Index i = 0; i < n; ++i) {
      if (beyond[i] > kLargestExcess) return DofNames(robot)[static_cast<std::size_t>(i)];
    }
  }
  return "";
}

/// Returns the share of the segment that is covered after the share t of its time: the cubic h with h(0) = 0, h(1) = 1
/// and h' = kSlowStart at both ends.
double ShareAt(double t) { return t * (kSlowStart + t * (1.0 - kSlowStart) * (3.0 - 2.0 * t)); }

/// Inverse of ShareAt, by bisection: the same bits everywhere.
double TimeOfShare(double share) {
  constexpr int kBits = 52;
  double low = 0.0, high = 1.0;
  for (int i = 0; i < kBits; ++i) {
    const double middle = 0.5 * (low + high);
    (ShareAt(middle) < share ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace

void SlowDownAtWaypoints(std::size_t segment, TimedPath* path) {
  const std::size_t first = path->waypoints[segment], last = path->waypoints[segment + 1];
  for (std::size_t i = first + 1; i < last; ++i) {
    const double share = static_cast<double>(i - first) / static_cast<double>(last - first);
    path->times[i] = path->times[first] + TimeOfShare(share);
  }
}

std::vector<CurveFault> FindCurveFaults(const RobotModel& robot, PathSolver& paths, const TimedPath& path,
                                        std::span<const Stance* const> stances) {
  const PathSpline spline(path.times, path.points);
  std::vector<CurveFault> faults;
  for (std::size_t w = 0; w + 1 < path.waypoints.size(); ++w) {
    const std::vector<Eigen::VectorXd> samples = SamplesOf(spline, path, w);
    const std::string joint = JointBeyondLimits(robot, samples);
    const std::string message =
        joint.empty() ? paths.FaultOf(stances.subspan(w, 2), samples) : joint + " exceeds its limit between the points";
    if (!message.empty()) faults.push_back({static_cast<int>(w), message});
  }
  return faults;
}

}  // namespace legopt

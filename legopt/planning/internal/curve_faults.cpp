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

/// Returns the points of the spline on the piece from point i to the next, both included.
std::vector<Eigen::VectorXd> SamplesOf(const PathSpline& spline, const TimedPath& path, std::size_t i) {
  std::vector<Eigen::VectorXd> samples;
  CurvePoint point;
  for (int k = 0; k <= kSamplesPerPiece; ++k) {
    const double share = static_cast<double>(k) / kSamplesPerPiece;
    spline.Evaluate(path.times[i] + share * (path.times[i + 1] - path.times[i]), &point);
    samples.push_back(point.x);
  }
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

}  // namespace

std::vector<CurveFault> FindCurveFaults(const RobotModel& robot, PathSolver& paths, const TimedPath& path,
                                        std::span<const Stance* const> stances) {
  const PathSpline spline(path.times, path.points);
  std::vector<CurveFault> faults;
  for (std::size_t w = 0; w + 1 < path.waypoints.size(); ++w) {
    paths.Bind(stances.subspan(w, 2));
    for (std::size_t i = path.waypoints[w]; i < path.waypoints[w + 1]; ++i) {
      const std::vector<Eigen::VectorXd> samples = SamplesOf(spline, path, i);
      const std::string joint = JointBeyondLimits(robot, samples);
      const std::string message =
          joint.empty() ? paths.FaultOf(samples) : joint + " exceeds its limit between the points";
      if (!message.empty()) faults.push_back({i, w, message});
    }
  }
  return faults;
}

void InsertPoints(std::size_t piece, std::span<const Eigen::VectorXd> points, TimedPath* path) {
  const double from = path->times[piece], length = path->times[piece + 1] - from;
  const double pieces = static_cast<double>(points.size()) + 1.0;
  std::vector<double> times;
  for (std::size_t k = 1; k <= points.size(); ++k) times.push_back(from + length * static_cast<double>(k) / pieces);
  const auto next = static_cast<std::ptrdiff_t>(piece) + 1;
  path->points.insert(path->points.begin() + next, points.begin(), points.end());
  path->times.insert(path->times.begin() + next, times.begin(), times.end());
  for (std::size_t& waypoint : path->waypoints) {
    if (waypoint > piece) waypoint += points.size();
  }
}

}  // namespace legopt

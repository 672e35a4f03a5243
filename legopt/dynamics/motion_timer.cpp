#include "legopt/dynamics/motion_timer.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "legopt/dataset/contact.h"
#include "legopt/robot/configuration.h"
#include "legopt/types/input_error.h"

namespace legopt {
namespace {

/// Returns whether all points are the same configuration, up to rounding.
bool IsAtRest(std::span<const Eigen::VectorXd> points) {
  constexpr double kEqual = 1e-12;
  const auto first = PartsOf(points.front());
  return std::ranges::all_of(points, [&](const Eigen::VectorXd& x) {
    const auto parts = PartsOf(x);
    const double turn = std::abs(parts.base_rotation().dot(first.base_rotation()));
    return (parts.linear() - first.linear()).norm() <= kEqual && turn >= 1.0 - kEqual;
  });
}

[[noreturn]] void Fail(const std::string& field, const std::string& value, const std::string& fix) {
  throw InputError({.file = "motion", .field = field, .value = value, .message = "cannot be timed", .fix = fix});
}

/// Checks that times increase from 0 to the last waypoint and include each waypoint.
void CheckTimes(size_t stances, std::span<const double> times) {
  if (stances < 2) Fail("waypoints", std::to_string(stances), "give at least two waypoints");
  if (times.empty() || times.front() != 0.0) Fail("first time", times.empty() ? "none" : "not 0", "begin at 0");
  size_t waypoint = 0;
  for (size_t i = 0; i < times.size(); ++i) {
    if (i > 0 && !(times[i] > times[i - 1])) Fail("time", std::to_string(times[i]), "let times increase");
    if (times[i] == static_cast<double>(waypoint)) ++waypoint;
  }
  if (waypoint != stances) Fail("times", "not that of waypoint " + std::to_string(waypoint), "include each waypoint");
  if (times.back() != static_cast<double>(stances - 1)) {
    Fail("last time", std::to_string(times.back()), "end at the last waypoint");
  }
}

void CheckPoints(std::span<const double> times, std::span<const Eigen::VectorXd> points, Eigen::Index size) {
  constexpr double kLargest = 1e6, kSmallestNorm = 1e-6;
  if (times.size() != points.size()) Fail("points", std::to_string(points.size()), "give one point for each time");
  for (const Eigen::VectorXd& x : points) {
    if (x.size() != size) Fail("point", std::to_string(x.size()) + " numbers", "give " + std::to_string(size));
    if (!x.allFinite()) Fail("point", "not finite", "remove NaN and infinity");
    if (x.cwiseAbs().maxCoeff() > kLargest) Fail("point", "a number above 1e6", "give rad and m");
    if (x.tail<4>().norm() < kSmallestNorm) Fail("point", "quaternion 0", "give a unit quaternion");
  }
}

}  // namespace

MotionTimer::MotionTimer(const Dataset& dataset)
    : dataset_(dataset),
      builder_(dataset.robot(), dataset.gravity_m_s2()),
      reduced_builder_(dataset.robot(), dataset.gravity_m_s2(), MotionTiming::kReducedShare) {}

MotionTimer::Part MotionTimer::MakePart(const Stance& contacts) const {
  std::vector<TouchedSurface> surfaces = SurfacesOf(dataset_, contacts);
  const StanceForces forces(surfaces);
  for (TouchedSurface& surface : surfaces) surface.friction *= MotionTiming::kReducedShare;
  return {.contacts = contacts, .forces = forces, .reduced = StanceForces(surfaces)};
}

std::vector<double> MotionTimer::Grid(std::span<const double> times, int refinement) const {
  std::vector<double> grid = {times.front()};
  size_t first = 0;  // first point of the segment
  for (size_t i = 1; i < times.size(); ++i) {
    if (times[i] != std::floor(times[i])) continue;
    const auto pieces = static_cast<int>(i - first);
    const int per_piece = std::max(kLeastPerPiece, (kLeastPerSegment + pieces - 1) / pieces) << refinement;
    for (size_t p = first; p < i; ++p) {
      for (int k = 1; k <= per_piece; ++k) {
        grid.push_back(k == per_piece ? times[p + 1] : times[p] + (times[p + 1] - times[p]) * k / per_piece);
      }
    }
    first = i;
  }
  return grid;
}

PathLimits MotionTimer::Limits(const PathSpline& spline, const std::vector<double>& grid, bool reduced) {
  PhaseSetBuilder& builder = reduced ? reduced_builder_ : builder_;
  builder.Restart();
  const auto set_at = [&](double s, const Part& part, double slack) {
    spline.Evaluate(s, &point_);
    return builder.Compute(reduced ? part.reduced : part.forces, point_, slack);
  };
  std::vector<PhaseSet> begins, ends;
  PhaseSet start = set_at(grid.front(), ends_.front(), kRestSlack);
  for (size_t k = 0; k + 1 < grid.size(); ++k) {
    const Part& segment = segments_[static_cast<size_t>(grid[k])];
    const bool at_waypoint = grid[k] == std::floor(grid[k]);
    begins.push_back(at_waypoint ? set_at(grid[k], segment, kCurveSlack) : ends.back());
    ends.push_back(set_at(grid[k + 1], segment, kCurveSlack));
  }
  PhaseSet end = set_at(grid.back(), ends_.back(), kRestSlack);
  return JoinSets(grid, begins, ends, std::move(start), std::move(end));
}

std::string MotionTimer::Name(const TimeBlock& block, const std::vector<double>& grid) const {
  const LimitOwner& owner = block.owner;
  if (owner.kind == TimeLimit::kNumerical) return "numerical failure";
  if (owner.kind == TimeLimit::kContact) {
    const bool rests = block.interval < 0;
    const Part& part = rests ? (block.point == 0 ? ends_.front() : ends_.back())
                             : segments_[static_cast<size_t>(grid[static_cast<size_t>(block.interval)])];
    int surface = 0;  // only contacts that carry have surfaces
    for (const ContactTarget& target : part.contacts.contacts) {
      if (target.carries && surface++ == owner.index) return "friction of " + target.contact;
    }
    return surface == 0 ? "no contact" : "contacts";
  }
  const std::string joint = owner.index < 0 ? "a joint" : DofNames(dataset_.robot())[static_cast<size_t>(owner.index)];
  return (owner.kind == TimeLimit::kTorque ? "torque of " : "velocity of ") + joint;
}

void MotionTimer::Report(const std::vector<double>& grid, const TimeLaw& law, MotionTiming* timing) const {
  timing->grid_points = static_cast<int>(grid.size());
  timing->shortest_s = law.duration_s;
  timing->optimal = law.optimal;
  timing->parameters = grid;
  timing->times_s.clear();
  timing->speed_squares = law.x;
  timing->limits = {};
  if (!law.exists) {
    if (law.blocked.point < 0) return;
    timing->blocked_at = grid[static_cast<size_t>(law.blocked.point)];
    timing->blocked_by = Name(law.blocked, grid);
    return;
  }
  timing->times_s.assign(1, 0.0);
  for (size_t k = 0; k + 1 < grid.size(); ++k) {
    const double width_s = Duration_s(std::span(grid).subspan(k, 2), std::span(law.x).subspan(k, 2));
    timing->times_s.push_back(timing->times_s.back() + width_s);
    const TimeLimit kind = law.limits[k].kind;
    double& share = kind == TimeLimit::kVelocity ? timing->limits.velocity
                    : kind == TimeLimit::kTorque ? timing->limits.torque
                                                 : timing->limits.contact;
    share = std::min(share + width_s / law.duration_s, 1.0);  // the sum of many rounded terms may exceed 1
  }
}

MotionTiming MotionTimer::Compute(std::span<const Stance* const> stances, std::span<const double> times,
                                  std::span<const Eigen::VectorXd> points) {
  CheckTimes(stances.size(), times);
  CheckPoints(times, points, dataset_.robot().configuration_size());
  MotionTiming timing;
  if (IsAtRest(points)) return timing;
  ends_.clear();
  for (const Stance* stance : {stances.front(), stances.back()}) ends_.push_back(MakePart(*stance));
  segments_.clear();
  for (size_t w = 1; w < stances.size(); ++w) {
    segments_.push_back(MakePart(PlantedContacts(dataset_, *stances[w - 1], *stances[w])));
  }
  const PathSpline spline({times.begin(), times.end()}, points);
  double before_s = 0.0;
  for (int refinement = 0; refinement <= kMostRefinements; ++refinement) {
    const std::vector<double> grid = Grid(times, refinement);
    if (grid.size() > kMostPoints) {
      if (refinement > 0) break;
      Fail("points", std::to_string(points.size()), "give the path fewer points; the grid may have 200,000");
    }
    const PathLimits limits = Limits(spline, grid, false);
    const TimeLaw law = ComputeTimeLaw(limits);
    timing.greedy_s = ComputeGreedyTimeLaw(limits).duration_s;
    timing.uniform_s = UniformDuration_s(limits);
    Report(grid, law, &timing);
    if (!law.exists) break;
    timing.grid_change = refinement == 0 ? 1.0 : std::abs(law.duration_s - before_s) / law.duration_s;
    before_s = law.duration_s;
    if (timing.grid_change < kGridAccuracy) break;
  }
  timing.reduced_s = std::numeric_limits<double>::infinity();
  if (std::isfinite(timing.shortest_s)) {
    timing.reduced_s = ComputeTimeLaw(Limits(spline, timing.parameters, true)).duration_s;
  }
  return timing;
}

}  // namespace legopt

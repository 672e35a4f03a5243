#include "legopt/dynamics/time_law.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "legopt/dynamics/internal/chain_program.h"
#include "legopt/dynamics/internal/phase_polygon.h"
#include "legopt/types/invariant.h"

namespace legopt {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Closed interval; empty if lowest > highest.
struct Interval {
  double lowest = kInfinity, highest = -kInfinity;
  void Add(double value) {
    lowest = std::min(lowest, value);
    highest = std::max(highest, value);
  }
  bool empty() const { return lowest > highest; }
};

/// Returns the values of x in a set from which x + 2 width u lies in `next`.
Interval Predecessors(const PhaseSet& set, double width, const Interval& next) {
  // Rounding of a linear program must not empty an interval that is a single point.
  const double rounding = 1e-9 * (1.0 + std::abs(next.highest));
  std::vector<PhaseCorner> kept = CornersOf(set, 1.0);
  const Eigen::Vector2d next_x(2.0 * width, 1.0);
  ClipPolygon(next_x, next.highest + rounding, {}, 0.0, &kept);
  ClipPolygon(-next_x, -next.lowest + rounding, {}, 0.0, &kept);
  Interval result;
  for (const PhaseCorner& corner : kept) result.Add(std::max(0.0, corner.at.y()));
  return result;
}

/// Returns the values of x + 2 width u for given x.
Interval Successors(const PhaseSet& set, double width, double x) {
  Interval result;
  for (size_t i = 0; i < set.corners.size(); ++i) {
    const Eigen::Vector2d& from = set.corners[i];
    const Eigen::Vector2d& to = set.corners[(i + 1) % set.corners.size()];
    const double low = std::min(from.y(), to.y()), high = std::max(from.y(), to.y());
    const double rounding = 1e-9 * (1.0 + high);
    if (x < low - rounding || x > high + rounding) continue;
    const auto at = [&](double share) { result.Add(x + 2.0 * width * (from.x() + share * (to.x() - from.x()))); };
    if (high - low > rounding) {
      at(std::clamp((x - from.y()) / (to.y() - from.y()), 0.0, 1.0));
    } else {
      at(0.0);
      at(1.0);
    }
  }
  return result;
}

double WidthOf(std::span<const double> grid, size_t k) { return grid[k + 1] - grid[k]; }

/// Rounding of linear programs, in units of an edge's offset.
constexpr double kRestRounding = 1e-7;

/// Returns the edge that excludes (u, x) = (0, 0) most; null if the set contains it.
const PhaseEdge* EdgeAgainstRest(const PhaseSet& set) {
  const auto least = std::ranges::min_element(set.edges, {}, &PhaseEdge::c);
  return least != set.edges.end() && least->c < -kRestRounding ? &*least : nullptr;
}

bool CanRest(const PhaseSet& set) { return !set.empty() && EdgeAgainstRest(set) == nullptr; }

/// Returns the limit that makes a point hard to pass: of an empty set, the one that empties it; else the one that
/// excludes rest, or bounds x most tightly.
LimitOwner LimitAt(const PhaseSet& set) {
  if (set.empty()) return set.blocked_by;
  if (const PhaseEdge* edge = EdgeAgainstRest(set)) return edge->owner;
  double least = kInfinity;
  LimitOwner owner;
  for (const PhaseEdge& edge : set.edges) {
    if (!(edge.b > 0.0 && edge.c / edge.b < least)) continue;
    least = edge.c / edge.b;
    owner = edge.owner;
  }
  return owner;
}

TimeLaw Blocked(const TimeBlock& block) {
  TimeLaw law;
  law.duration_s = kInfinity;
  law.blocked = block;
  return law;
}

/// Block at a point that can be passed by itself, but not from rest to rest.
TimeLaw BlockedAt(const PathLimits& path, size_t point) {
  const size_t k = std::min(point, path.intervals.size() - 1);
  return Blocked({static_cast<int>(point), static_cast<int>(k), LimitAt(path.intervals[k])});
}

/// Sets the limit of each interval: the edge with the least slack.
void SetLimits(const PathLimits& path, TimeLaw* law) {
  constexpr double kLevel = 1.0 - 1e-9;
  for (size_t k = 0; k < path.intervals.size(); ++k) {
    const double x = law->x[k], u = (law->x[k + 1] - x) / (2.0 * WidthOf(path.grid, k));
    double least = kInfinity;
    LimitOwner owner;
    for (const PhaseEdge& edge : path.intervals[k].edges) {
      if (edge.b < -kLevel) continue;  // x >= 0
      const double slack = edge.c - edge.a * u - edge.b * x;
      if (!(slack < least)) continue;
      least = slack;
      owner = edge.owner;
    }
    law->limits.push_back(owner);
  }
}

}  // namespace

ControllableSets ComputeControllableSets(const PathLimits& path) {
  const size_t count = path.grid.size();
  CheckInvariant(count >= 2 && path.intervals.size() + 1 == count,
                 "a time law has a set for each interval of its grid");
  ControllableSets controllable;
  controllable.lowest.assign(count, kInfinity);
  controllable.highest.assign(count, -kInfinity);
  controllable.lowest.back() = controllable.highest.back() = 0.0;
  for (size_t k = count - 1; k-- > 0;) {
    const Interval next{controllable.lowest[k + 1], controllable.highest[k + 1]};
    const PhaseSet& set = path.intervals[k];
    const Interval here = set.empty() ? Interval() : Predecessors(set, WidthOf(path.grid, k), next);
    controllable.lowest[k] = here.lowest;
    controllable.highest[k] = here.highest;
    if (!here.empty()) continue;
    controllable.blocked = static_cast<int>(k);
    break;
  }
  return controllable;
}

double Duration_s(std::span<const double> grid, std::span<const double> x) {
  double duration_s = 0.0;
  for (size_t k = 0; k + 1 < grid.size(); ++k) {
    const double sum = std::sqrt(std::max(0.0, x[k])) + std::sqrt(std::max(0.0, x[k + 1]));
    duration_s += sum > 0.0 ? 2.0 * WidthOf(grid, k) / sum : kInfinity;
  }
  return duration_s;
}

TimeLaw ComputeGreedyTimeLaw(const PathLimits& path) {
  if (path.empty.point >= 0) return Blocked(path.empty);
  const int last = static_cast<int>(path.grid.size()) - 1;
  if (!CanRest(path.start)) return Blocked({0, -1, LimitAt(path.start)});
  if (!CanRest(path.end)) return Blocked({last, -1, LimitAt(path.end)});
  const ControllableSets controllable = ComputeControllableSets(path);
  if (controllable.blocked >= 0) return BlockedAt(path, static_cast<size_t>(controllable.blocked));
  constexpr double kRest = 1e-9;
  if (controllable.lowest.front() > kRest) return BlockedAt(path, 0);
  constexpr double kInside = 1.0 - 1e-4;  // rounding could leave no successor at the upper bound
  TimeLaw law;
  law.x.assign(path.grid.size(), 0.0);
  for (size_t k = 0; k < path.intervals.size(); ++k) {
    const Interval reached = Successors(path.intervals[k], WidthOf(path.grid, k), law.x[k]);
    const double lowest = controllable.lowest[k + 1], highest = controllable.highest[k + 1];
    const double next = std::max(reached.lowest, std::min(reached.highest, lowest + kInside * (highest - lowest)));
    const double rounding = kRest * (1.0 + highest);
    if (reached.empty() || next < lowest - rounding || next > highest + rounding) return BlockedAt(path, k);
    law.x[k + 1] = std::max({next, lowest, 0.0});
  }
  law.duration_s = Duration_s(path.grid, law.x);
  if (!std::isfinite(law.duration_s)) {  // rest is the only admissible state of two neighbours
    const auto still = std::ranges::adjacent_find(law.x, [](double a, double b) { return a + b <= 0.0; });
    return BlockedAt(path, static_cast<size_t>(still - law.x.begin()));
  }
  law.exists = true;
  SetLimits(path, &law);
  return law;
}

TimeLaw ComputeTimeLaw(const PathLimits& path) {
  TimeLaw law = ComputeGreedyTimeLaw(path);
  if (!law.exists) return law;
  std::vector<double> x = law.x;
  if (!MinimizeDuration(path, &x)) return law;
  const double duration_s = Duration_s(path.grid, x);
  law.optimal = duration_s >= law.duration_s;
  if (!(duration_s < law.duration_s)) return law;
  law.x = std::move(x);
  law.optimal = true;
  law.duration_s = duration_s;
  law.limits.clear();
  SetLimits(path, &law);
  return law;
}

double UniformDuration_s(const PathLimits& path) {
  double largest = kInfinity;
  for (const PhaseSet& set : path.intervals) {
    Interval x;
    for (size_t i = 0; i < set.corners.size(); ++i) {
      const Eigen::Vector2d& from = set.corners[i];
      const Eigen::Vector2d& to = set.corners[(i + 1) % set.corners.size()];
      if (from.x() == 0.0) x.Add(from.y());
      if ((from.x() < 0.0) == (to.x() < 0.0)) continue;
      x.Add(from.y() + from.x() / (from.x() - to.x()) * (to.y() - from.y()));
    }
    largest = std::min(largest, x.highest);
  }
  return largest > 0.0 ? (path.grid.back() - path.grid.front()) / std::sqrt(largest) : kInfinity;
}

}  // namespace legopt

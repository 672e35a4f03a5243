#include "legopt/dynamics/path_limits.h"

#include <algorithm>
#include <utility>

#include "legopt/dynamics/internal/phase_polygon.h"
#include "legopt/types/invariant.h"

namespace legopt {
namespace {

/// Returns the pairs (u, x) of `begin` with (u, x + 2 width u) in `end`; if there are none, with the limit that
/// excludes the last of them.
PhaseSet IntervalSet(const PhaseSet& begin, const PhaseSet& end, double width) {
  if (begin.empty()) return begin;
  if (end.empty()) return end;
  // A common scale for both; sets of a robot that can only rest have none.
  double unit = 0.0;
  for (const Eigen::Vector2d& corner : begin.corners) unit = std::max(unit, corner.y());
  for (const Eigen::Vector2d& corner : end.corners) unit = std::max(unit, corner.y());
  if (!(unit > 0.0)) unit = 1.0;
  constexpr double kRounding = 1e-9;  // rounding of linear programs must not empty a single point
  std::vector<PhaseCorner> corners = CornersOf(begin, unit);
  for (const PhaseEdge& edge : end.edges) {
    const Eigen::Vector2d normal(edge.a + 2.0 * width * edge.b, edge.b);
    const double norm = normal.norm();
    if (!(norm > 0.0)) continue;
    ClipPolygon(normal / norm, edge.c / (unit * norm) + kRounding, edge.owner, kRounding, &corners);
    if (!corners.empty()) continue;
    PhaseSet none;
    none.blocked_by = edge.owner;
    return none;
  }
  return SetOf(corners, unit);
}

}  // namespace

PathLimits JoinSets(std::vector<double> grid, std::span<const PhaseSet> begins, std::span<const PhaseSet> ends,
                    PhaseSet start, PhaseSet end) {
  CheckInvariant(grid.size() >= 2 && begins.size() + 1 == grid.size() && ends.size() == begins.size(),
                 "a path has a set for both ends of each interval");
  PathLimits limits;
  limits.grid = std::move(grid);
  limits.start = std::move(start);
  limits.end = std::move(end);
  for (size_t k = 0; k < begins.size(); ++k) {
    limits.intervals.push_back(IntervalSet(begins[k], ends[k], limits.grid[k + 1] - limits.grid[k]));
    if (!limits.intervals.back().empty() || limits.empty.point >= 0) continue;
    const bool at_end = !begins[k].empty() && ends[k].empty();
    limits.empty = {static_cast<int>(at_end ? k + 1 : k), static_cast<int>(k), limits.intervals.back().blocked_by};
  }
  return limits;
}

PathLimits JoinSets(std::vector<double> grid, std::span<const PhaseSet> sets) {
  return JoinSets(std::move(grid), sets.first(sets.size() - 1), sets.last(sets.size() - 1), sets.front(), sets.back());
}

}  // namespace legopt

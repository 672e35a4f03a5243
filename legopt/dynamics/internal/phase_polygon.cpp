#include "legopt/dynamics/internal/phase_polygon.h"

#include <algorithm>
#include <utility>

namespace legopt {
namespace {

/// Returns the half-planes whose intersection has these corners.
std::vector<PhaseEdge> EdgesOf(const std::vector<PhaseCorner>& corners) {
  std::vector<PhaseEdge> edges;
  const auto add = [&](const Eigen::Vector2d& normal, const PhaseCorner& corner) {
    edges.push_back({normal.x(), normal.y(), normal.dot(corner.at), corner.owner});
  };
  if (corners.size() == 1) {
    for (const double sign : {1.0, -1.0}) {
      add(sign * Eigen::Vector2d::UnitX(), corners.front());
      add(sign * Eigen::Vector2d::UnitY(), corners.front());
    }
    return edges;
  }
  for (size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector2d along = (corners[(i + 1) % corners.size()].at - corners[i].at).normalized();
    add({along.y(), -along.x()}, corners[i]);
    if (corners.size() == 2) add(-along, corners[i]);
  }
  return edges;
}

}  // namespace

void MergeCorners(double rounding, std::vector<PhaseCorner>* corners) {
  std::vector<PhaseCorner> kept;
  for (const PhaseCorner& corner : *corners) {
    if (!kept.empty() && (corner.at - kept.back().at).norm() <= rounding) {
      kept.back().owner = corner.owner;  // the edge that begins here
    } else {
      kept.push_back(corner);
    }
  }
  while (kept.size() > 1 && (kept.front().at - kept.back().at).norm() <= rounding) kept.pop_back();
  *corners = std::move(kept);
}

void ClipPolygon(const Eigen::Vector2d& normal, double offset, const LimitOwner& owner, double rounding,
                 std::vector<PhaseCorner>* corners) {
  const auto is_inside = [&](const PhaseCorner& corner) { return normal.dot(corner.at) <= offset; };
  if (std::ranges::all_of(*corners, is_inside)) return;
  std::vector<PhaseCorner> kept;
  for (size_t i = 0; i < corners->size(); ++i) {
    const PhaseCorner& from = (*corners)[i];
    const PhaseCorner& to = (*corners)[(i + 1) % corners->size()];
    const double before = normal.dot(from.at) - offset, after = normal.dot(to.at) - offset;
    if (before <= 0.0) kept.push_back({from.at, before == 0.0 && after > 0.0 ? owner : from.owner});
    if (before * after >= 0.0) continue;
    kept.push_back({from.at + before / (before - after) * (to.at - from.at), after > 0.0 ? owner : from.owner});
  }
  *corners = std::move(kept);
  MergeCorners(rounding, corners);
}

PhaseSet SetOf(const std::vector<PhaseCorner>& corners, double unit) {
  PhaseSet set;
  set.edges = EdgesOf(corners);
  for (PhaseEdge& edge : set.edges) edge.c *= unit;
  for (const PhaseCorner& corner : corners) set.corners.emplace_back(unit * corner.at);
  return set;
}

std::vector<PhaseCorner> CornersOf(const PhaseSet& set, double unit) {
  const size_t edges_per_corner = set.edges.size() / set.corners.size();  // two corners have four edges, one has all
  std::vector<PhaseCorner> corners;
  for (size_t i = 0; i < set.corners.size(); ++i) {
    corners.push_back({set.corners[i] / unit, set.edges[i * edges_per_corner].owner});
  }
  return corners;
}

}  // namespace legopt

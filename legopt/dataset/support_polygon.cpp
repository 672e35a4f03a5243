#include "legopt/dataset/support_polygon.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <limits>

#include "legopt/dataset/dataset.h"

namespace legopt {
namespace {

/// Corners closer than this (metres) are merged, since a very short edge has no reliable direction.
constexpr double kMergeDistance_m = 1e-9;

double Cross(const Eigen::Vector2d& o, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector2d u = a - o;
  const Eigen::Vector2d v = b - o;
  return u.x() * v.y() - u.y() * v.x();
}

/// Appends `point` to the chain `hull[begin..]` and removes points that are not left turns.
void ExtendChain(const Eigen::Vector2d& point, size_t begin, std::vector<Eigen::Vector2d>* hull) {
  while (hull->size() >= begin + 2 && Cross((*hull)[hull->size() - 2], hull->back(), point) <= 0) hull->pop_back();
  hull->push_back(point);
}

void MergeShortEdges(std::vector<Eigen::Vector2d>* hull) {
  std::vector<Eigen::Vector2d> kept;
  for (const Eigen::Vector2d& corner : *hull) {
    const bool repeats_last = !kept.empty() && (corner - kept.back()).norm() < kMergeDistance_m;
    const bool repeats_first = !kept.empty() && (corner - kept.front()).norm() < kMergeDistance_m;
    if (!repeats_last && !repeats_first) kept.push_back(corner);
  }
  *hull = std::move(kept);
}

HalfPlane Through(const Eigen::Vector2d& point, const Eigen::Vector2d& outward) {
  return {.normal = outward, .offset = -outward.dot(point)};
}

}  // namespace

std::vector<Eigen::Vector2d> ConvexHull2d(std::vector<Eigen::Vector2d> points) {
  std::sort(points.begin(), points.end(), [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  });
  std::vector<Eigen::Vector2d> hull;
  for (const Eigen::Vector2d& point : points) ExtendChain(point, 0, &hull);
  const size_t lower = hull.empty() ? 0 : hull.size() - 1;
  for (size_t i = points.size(); i-- > 1;) ExtendChain(points[i - 1], lower, &hull);
  MergeShortEdges(&hull);
  return hull;
}

std::vector<Eigen::Vector2d> SupportPolygon(std::span<const ContactPlacement> contacts) {
  std::vector<Eigen::Vector2d> corners;
  corners.reserve(4 * contacts.size());
  for (const ContactPlacement& placement : contacts) {
    if (!DescriptionOf(placement.contact->kind).supports) continue;
    for (const Eigen::Vector3d& point : placement.contact->points_L) {
      corners.emplace_back((placement.X_WL * point).head<2>());
    }
  }
  return ConvexHull2d(std::move(corners));
}

std::vector<Eigen::Vector2d> TargetSupportPolygon(const Dataset& dataset, const Stance& stance) {
  std::vector<ContactPlacement> placements;
  placements.reserve(stance.contacts.size());
  for (const ContactTarget& target : stance.contacts) {
    const Contact& contact = dataset.contact(target.contact);
    placements.push_back({.contact = &contact, .X_WL = contact.LinkTarget(target)});
  }
  return SupportPolygon(placements);
}

std::vector<HalfPlane> Edges(std::span<const Eigen::Vector2d> polygon) {
  if (polygon.empty()) {
    std::fprintf(stderr, "Edges: the polygon is empty\n");
    std::abort();
  }
  if (polygon.size() <= 2) {
    const Eigen::Vector2d& a = polygon.front();
    const Eigen::Vector2d& b = polygon.back();
    const Eigen::Vector2d along = polygon.size() == 2 ? Eigen::Vector2d((b - a).normalized()) : Eigen::Vector2d(1, 0);
    const Eigen::Vector2d across(along.y(), -along.x());
    return {Through(a, across), Through(b, along), Through(a, -across), Through(a, -along)};
  }
  std::vector<HalfPlane> edges;
  edges.reserve(polygon.size());
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d along = (polygon[(i + 1) % polygon.size()] - polygon[i]).normalized();
    edges.push_back(Through(polygon[i], {along.y(), -along.x()}));
  }
  return edges;
}

double SignedDistanceToPolygon(std::span<const Eigen::Vector2d> polygon, const Eigen::Vector2d& c) {
  double largest = -std::numeric_limits<double>::infinity();
  for (const HalfPlane& edge : Edges(polygon)) largest = std::max(largest, edge.Distance(c));
  return largest;
}

}  // namespace legopt

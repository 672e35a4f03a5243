#include "legopt/worldgen/cell_contacts.h"

#include <algorithm>
#include <numeric>

#include "legopt/geometry/signed_distance.h"

namespace legopt::worldgen {

using Eigen::Vector3d;

CellContacts::CellContacts(const std::vector<Cell>& cells)
    : motions_(cells.size(), Eigen::Isometry3d::Identity()), present_(cells.size(), true), bounds_(cells.size()) {
  for (const Cell& cell : cells) {
    shapes_.push_back(ConvexShape::FromHull(ComputeHull(cell.vertices)));
    ranges_.push_back(rest_.Add(shapes_.back().points()));
  }
  placed_.ResizeLike(rest_);
  for (size_t i = 0; i < cells.size(); ++i) Place(static_cast<int>(i), Eigen::Isometry3d::Identity());
}

void CellContacts::Place(int cell, const Eigen::Isometry3d& motion) {
  const auto i = static_cast<size_t>(cell);
  motions_[i] = motion;
  placed_.Transform(rest_, ranges_[i], motion, bounds_[i].min(), bounds_[i].max());
}

void CellContacts::Remove(int cell) { present_[static_cast<size_t>(cell)] = false; }

std::vector<std::pair<int, int>> CellContacts::Pairs(const std::vector<bool>& active) const {
  std::vector<int> order;
  for (size_t i = 0; i < present_.size(); ++i) {
    if (present_[i]) order.push_back(static_cast<int>(i));
  }
  const auto low = [&](int i) { return bounds(i).min().x(); };
  std::sort(order.begin(), order.end(), [&](int a, int b) { return low(a) != low(b) ? low(a) < low(b) : a < b; });
  std::vector<std::pair<int, int>> pairs;
  for (size_t i = 0; i < order.size(); ++i) {
    const int a = order[i];
    const double end = bounds(a).max().x();
    for (size_t j = i + 1; j < order.size() && low(order[j]) <= end; ++j) {
      const int b = order[j];
      if (!active[static_cast<size_t>(a)] && !active[static_cast<size_t>(b)]) continue;
      if (bounds(a).intersects(bounds(b))) pairs.emplace_back(std::min(a, b), std::max(a, b));
    }
  }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

SupportSet CellContacts::SetOf(int cell) const {
  const auto i = static_cast<size_t>(cell);
  SupportSet set;
  placed_.View(ranges_[i], set);
  PlaceSupportSet(shapes_[i], motions_[i], set);
  set.lower = bounds_[i].min();
  set.upper = bounds_[i].max();
  return set;
}

double CellContacts::PlaneDistance(int cell, const Vector3d& point) const {
  const auto i = static_cast<size_t>(cell);
  return shapes_[i].hull().PlaneDistance(motions_[i].inverse(Eigen::Isometry) * point);
}

std::vector<CellContacts::Point> CellContacts::Touch(int a, int b) const {
  PairDistance distance;
  if (!SignedDistance(SetOf(a), SetOf(b), 0.0, distance)) return {};
  const Vector3d& normal = distance.normal;
  std::vector<Point> points;
  const auto add_vertices = [&](int of, int in, double sign) {
    const auto i = static_cast<size_t>(of);
    const SupportSet other = SetOf(in);
    const double support = normal.dot(other.Farthest(sign * normal));
    for (const Vector3d& vertex : shapes_[i].points()) {
      const Vector3d p = motions_[i] * vertex;
      constexpr double kSlack = 1e-3;
      if (!bounds(in).contains(p) || PlaneDistance(in, p) > kSlack) continue;
      const double depth = sign * (support - normal.dot(p));
      if (depth > 0.0) points.push_back({p, normal, std::min(depth, -distance.distance_m)});
    }
  };
  add_vertices(a, b, 1.0);
  add_vertices(b, a, -1.0);
  points.push_back({0.5 * (distance.point_a + distance.point_b), normal, -distance.distance_m});
  std::stable_sort(points.begin(), points.end(), [](const Point& p, const Point& q) { return p.depth_m > q.depth_m; });
  if (points.size() > kMaxPoints) {
    // Keeps the deepest point, then repeatedly the one farthest from all kept points: a few spread-out points carry the
    // load.
    std::vector<Point> kept = {points.front()};
    std::vector<double> gap(points.size());
    for (size_t k = 0; k < points.size(); ++k) gap[k] = (points[k].position - kept[0].position).squaredNorm();
    while (kept.size() < kMaxPoints) {
      const auto best = static_cast<size_t>(std::max_element(gap.begin(), gap.end()) - gap.begin());
      kept.push_back(points[best]);
      for (size_t k = 0; k < points.size(); ++k) {
        gap[k] = std::min(gap[k], (points[k].position - kept.back().position).squaredNorm());
      }
    }
    points = std::move(kept);
  }
  return points;
}

}  // namespace legopt::worldgen

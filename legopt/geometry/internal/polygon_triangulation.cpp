#include "legopt/geometry/internal/polygon_triangulation.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <numeric>

namespace legopt {
namespace {

using Eigen::Vector2d;

double CrossOf(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

/// Ear clipping of one outline, which may touch itself along the bridges to its holes.
class EarClipper {
 public:
  EarClipper(const std::vector<Vector2d>& points, std::vector<int> ring) : points_(points), ring_(std::move(ring)) {}

  std::vector<std::array<int, 3>> Run() {
    std::vector<std::array<int, 3>> triangles;
    while (ring_.size() > 3) {
      const std::size_t ear = FindEar();
      if (ear == ring_.size()) return {};
      triangles.push_back({At(ear + ring_.size() - 1), At(ear), At(ear + 1)});
      ring_.erase(ring_.begin() + static_cast<std::ptrdiff_t>(ear));
      start_ = ring_.empty() ? 0 : (ear + 1) % ring_.size();  // not the next corner: fans make slivers
    }
    if (ring_.size() == 3) triangles.push_back({ring_[0], ring_[1], ring_[2]});
    return triangles;
  }

 private:
  int At(std::size_t i) const { return ring_[i % ring_.size()]; }
  const Vector2d& Point(int i) const { return points_[static_cast<std::size_t>(i)]; }

  /// Returns the position of an ear with area, else of a corner on a line, else the size of the ring.
  std::size_t FindEar() const {
    std::size_t on_line = ring_.size();
    for (std::size_t k = 0; k < ring_.size(); ++k) {
      const std::size_t i = (start_ + k) % ring_.size();
      const Vector2d &a = Point(At(i + ring_.size() - 1)), &b = Point(At(i)), &c = Point(At(i + 1));
      const double area = CrossOf(a, b, c);
      const double scale = std::max((b - a).squaredNorm(), (c - b).squaredNorm());
      constexpr double kFlat = 1e-9;
      if (area > kFlat * scale) {
        if (IsEar(i, a, b, c)) return i;
      } else if (on_line == ring_.size() && area >= -kFlat * scale) {
        on_line = i;
      }
    }
    return on_line;
  }

  bool IsEar(std::size_t i, const Vector2d& a, const Vector2d& b, const Vector2d& c) const {
    for (std::size_t k = 2; k + 1 < ring_.size(); ++k) {
      const Vector2d& p = Point(At(i + k));
      if (p == a || p == b || p == c) continue;
      if (CrossOf(a, b, p) >= 0.0 && CrossOf(b, c, p) >= 0.0 && CrossOf(c, a, p) >= 0.0) return false;
    }
    return true;
  }

  const std::vector<Vector2d>& points_;
  std::vector<int> ring_;
  std::size_t start_ = 0;
};

bool Crosses(const Vector2d& a, const Vector2d& b, const Vector2d& c, const Vector2d& d) {
  if (a == c || a == d || b == c || b == d) return false;
  return CrossOf(a, b, c) * CrossOf(a, b, d) <= 0.0 && CrossOf(c, d, a) * CrossOf(c, d, b) <= 0.0;
}

/// Joins a hole to the ring by the shortest bridge that crosses neither the ring nor any hole. Returns false if there
/// is none.
bool Bridge(const std::vector<Vector2d>& points, const std::vector<std::vector<int>>& holes,
            const std::vector<int>& hole, std::vector<int>* ring) {
  const auto at = [&](int i) -> const Vector2d& { return points[static_cast<std::size_t>(i)]; };
  const auto crosses = [&](const std::vector<int>& outline, const Vector2d& a, const Vector2d& b) {
    for (std::size_t k = 0; k < outline.size(); ++k) {
      if (Crosses(a, b, at(outline[k]), at(outline[(k + 1) % outline.size()]))) return true;
    }
    return false;
  };
  std::vector<std::size_t> order(ring->size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  // The corner of the hole with the largest x sees some corner of the ring or of another hole.
  const auto rightmost = static_cast<std::size_t>(
      std::max_element(hole.begin(), hole.end(), [&](int a, int b) { return at(a).x() < at(b).x(); }) - hole.begin());
  for (std::size_t shift = 0; shift < hole.size(); ++shift) {
    const std::size_t from = (rightmost + shift) % hole.size();
    const Vector2d& p = at(hole[from]);
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return (at((*ring)[a]) - p).squaredNorm() < (at((*ring)[b]) - p).squaredNorm();
    });
    for (const std::size_t to : order) {
      const Vector2d& q = at((*ring)[to]);
      const bool free = !crosses(*ring, p, q) && std::none_of(holes.begin(), holes.end(),
                                                              [&](const auto& other) { return crosses(other, p, q); });
      if (!free) continue;
      std::vector<int> joined(ring->begin(), ring->begin() + static_cast<std::ptrdiff_t>(to) + 1);
      for (std::size_t k = 0; k <= hole.size(); ++k) joined.push_back(hole[(from + k) % hole.size()]);
      joined.insert(joined.end(), ring->begin() + static_cast<std::ptrdiff_t>(to), ring->end());
      *ring = std::move(joined);
      return true;
    }
  }
  return false;
}

}  // namespace

double TwiceAreaOf(const std::vector<Vector2d>& points, const std::vector<int>& outline) {
  double sum = 0.0;
  const auto at = [&](std::size_t k) -> const Vector2d& {
    return points[static_cast<std::size_t>(outline[k % outline.size()])];
  };
  for (std::size_t k = 1; k + 1 < outline.size(); ++k) sum += CrossOf(at(0), at(k), at(k + 1));
  return sum;
}

bool IsInside(const Vector2d& point, const std::vector<Vector2d>& points, const std::vector<int>& outline) {
  bool inside = false;
  for (std::size_t k = 0; k < outline.size(); ++k) {
    const Vector2d& a = points[static_cast<std::size_t>(outline[k])];
    const Vector2d& b = points[static_cast<std::size_t>(outline[(k + 1) % outline.size()])];
    if ((a.y() > point.y()) == (b.y() > point.y())) continue;
    if (point.x() < a.x() + (point.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x())) inside = !inside;
  }
  return inside;
}

std::vector<std::array<int, 3>> TriangulatePolygon(const std::vector<Vector2d>& points, const std::vector<int>& outline,
                                                   const std::vector<std::vector<int>>& holes) {
  constexpr std::size_t kMaxCorners = 20'000;
  std::size_t corners = outline.size();
  for (const auto& hole : holes) corners += hole.size();
  if (outline.size() < 3 || corners > kMaxCorners) return {};
  std::vector<int> ring = outline;
  std::vector<std::vector<int>> waiting = holes;
  const auto right = [&](const std::vector<int>& hole) {
    double x = -std::numeric_limits<double>::infinity();
    for (const int i : hole) x = std::max(x, points[static_cast<std::size_t>(i)].x());
    return x;
  };
  std::stable_sort(waiting.begin(), waiting.end(), [&](const auto& a, const auto& b) { return right(a) > right(b); });
  for (const std::vector<int>& hole : waiting) {
    if (!Bridge(points, waiting, hole, &ring)) return {};
  }
  return EarClipper(points, std::move(ring)).Run();
}

}  // namespace legopt

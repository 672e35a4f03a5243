#include "legopt/statics/internal/support_search.h"

#include <cmath>
#include <cstddef>

namespace legopt {
namespace {

constexpr double kShortestChord = 1e-4 * 1e-4;

/// Returns the point where the supporting lines of two neighbours meet; the middle of the chord if they are parallel.
Eigen::Vector2d MeetingPoint(const Extreme& a, const Extreme& b) {
  constexpr double kParallel = 1e-12;
  const double determinant = a.direction.x() * b.direction.y() - a.direction.y() * b.direction.x();
  if (std::abs(determinant) < kParallel) return 0.5 * (a.position + b.position);
  const double height_a = a.direction.dot(a.position), height_b = b.direction.dot(b.position);
  return Eigen::Vector2d(height_a * b.direction.y() - height_b * a.direction.y(),
                         height_b * a.direction.x() - height_a * b.direction.x()) /
         determinant;
}

/// Returns the largest distance by which the polygon may lie outside of the chord from `a` to `b`, counter-clockwise,
/// and the chord's outward normal in `normal`.
double Uncertainty(const Extreme& a, const Extreme& b, Eigen::Vector2d* normal) {
  const Eigen::Vector2d chord = b.position - a.position;
  *normal = a.direction + b.direction;
  if (chord.norm() > kShortestChord) *normal = Eigen::Vector2d(chord.y(), -chord.x());
  if (!(normal->norm() > 0.0)) return 0.0;
  normal->normalize();
  return normal->dot(MeetingPoint(a, b) - a.position);
}

/// Cuts the largest uncertainty until none is above the accuracy. `extremes`: in the order of their directions,
/// counter-clockwise.
void Complete(const Furthest& furthest, double accuracy, std::vector<Extreme>* extremes) {
  constexpr size_t kMaxCorners = 400;
  std::vector<bool> done(extremes->size(), false);
  while (extremes->size() < kMaxCorners) {
    double largest = accuracy;
    size_t worst = extremes->size();
    Eigen::Vector2d normal, worst_normal;
    for (size_t i = 0; i < extremes->size(); ++i) {
      if (done[i]) continue;
      const double outside = Uncertainty((*extremes)[i], (*extremes)[(i + 1) % extremes->size()], &normal);
      if (!(outside > largest)) continue;
      largest = outside;
      worst = i;
      worst_normal = normal;
    }
    if (worst == extremes->size()) return;
    const std::optional<Extreme> found = furthest(worst_normal);
    constexpr double kShareOfAccuracy = 1e-2;
    if (!found || worst_normal.dot(found->position - (*extremes)[worst].position) < kShareOfAccuracy * accuracy) {
      done[worst] = true;  // the chord is an edge
      continue;
    }
    extremes->insert(extremes->begin() + static_cast<std::ptrdiff_t>(worst) + 1, *found);
    done.insert(done.begin() + static_cast<std::ptrdiff_t>(worst) + 1, false);
  }
}

}  // namespace

std::array<Eigen::Vector2d, 4> AxisDirections() {
  return {Eigen::Vector2d(1, 0), Eigen::Vector2d(0, 1), Eigen::Vector2d(-1, 0), Eigen::Vector2d(0, -1)};
}

std::vector<Extreme> SearchExtremes(const Furthest& furthest, double accuracy) {
  const auto axes = AxisDirections();
  std::vector<Extreme> extremes;
  for (const Eigen::Vector2d& direction : axes) {
    if (const std::optional<Extreme> extreme = furthest(direction)) extremes.push_back(*extreme);
  }
  if (extremes.size() == axes.size()) Complete(furthest, accuracy, &extremes);
  return extremes;
}

}  // namespace legopt

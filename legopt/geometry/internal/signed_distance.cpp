#include "legopt/geometry/internal/signed_distance.h"

#include <algorithm>
#include <limits>

namespace legopt {
namespace {

constexpr int kMaxIterations = 100;
constexpr double kTouching = 1e-9;      // m; EPA is used if the cores are closer than this
constexpr double kRelativeGap = 1e-10;  // relative to the squared distance
constexpr double kAbsoluteGap = 1e-14;  // m; multiplied by the distance

using Eigen::Vector3d;

/// Point nearest to the origin on one feature, with the feature's corners in the simplex.
struct Nearest {
  Vector3d point;
  double squared = std::numeric_limits<double>::infinity();
  int corners[3] = {0, 0, 0};
  double weights[3] = {1.0, 0.0, 0.0};
  int size = 1;
};

/// Reduces the simplex to the feature's corners. They ascend, so that no point is overwritten before it is read.
void Keep(Simplex& s, const Nearest& feature) {
  for (int k = 0; k < feature.size; ++k) {
    if (feature.corners[k] != k) s.points[k] = s.points[feature.corners[k]];
    s.weights[k] = feature.weights[k];
  }
  s.size = feature.size;
}

Nearest OnVertex(const Simplex& s, int i) {
  Nearest n;
  n.point = s.points[i].w;
  n.squared = n.point.squaredNorm();
  n.corners[0] = i;
  return n;
}

Nearest OnSegment(const Simplex& s, int i, int j) {
  const Vector3d& a = s.points[i].w;
  const Vector3d ab = s.points[j].w - a;
  const double length2 = ab.squaredNorm();
  const double t = -a.dot(ab);
  if (!(t > 0.0) || length2 == 0.0) return OnVertex(s, i);
  if (t >= length2) return OnVertex(s, j);
  Nearest n;
  const double u = t / length2;
  n.point = a + u * ab;
  n.squared = n.point.squaredNorm();
  n.corners[0] = i;
  n.corners[1] = j;
  n.weights[0] = 1.0 - u;
  n.weights[1] = u;
  n.size = 2;
  return n;
}

const Nearest& Better(const Nearest& a, const Nearest& b) { return b.squared < a.squared ? b : a; }

Nearest OnTriangle(const Simplex& s, int i, int j, int k) {
  const Vector3d& a = s.points[i].w;
  const Vector3d& b = s.points[j].w;
  const Vector3d& c = s.points[k].w;
  const Vector3d ab = b - a;
  const Vector3d ac = c - a;
  const Vector3d normal = ab.cross(ac);
  const double area2 = normal.squaredNorm();
  constexpr double kSliver = 1e-26;  // (2 area)^2 over (side)^4; below it the normal is unusable
  const double scale = std::max(ab.squaredNorm(), ac.squaredNorm());
  if (area2 > kSliver * scale * scale) {
    // Signed areas of the origin's projection against the three sides.
    const double wc = normal.dot(a.cross(b));
    const double wa = normal.dot(b.cross(c));
    const double wb = normal.dot(c.cross(a));
    if (wa > 0.0 && wb > 0.0 && wc > 0.0) {
      Nearest n;
      n.point = normal * (normal.dot(a) / area2);
      n.squared = n.point.squaredNorm();
      n.corners[0] = i;
      n.corners[1] = j;
      n.corners[2] = k;
      const double sum = wa + wb + wc;
      n.weights[0] = wa / sum;
      n.weights[1] = wb / sum;
      n.weights[2] = wc / sum;
      n.size = 3;
      return n;
    }
    // The projection is outside: the nearest point lies on one of the sides that separate it from the triangle.
    Nearest best;
    if (wc <= 0.0) best = OnSegment(s, i, j);
    if (wa <= 0.0) best = Better(best, OnSegment(s, j, k));
    if (wb <= 0.0) best = Better(best, OnSegment(s, i, k));
    return best;
  }
  return Better(Better(OnSegment(s, i, j), OnSegment(s, j, k)), OnSegment(s, i, k));
}

/// Returns false if the origin is inside the tetrahedron.
bool OnTetrahedron(const Simplex& s, Nearest& best) {
  static constexpr int kFaces[4][4] = {{0, 1, 2, 3}, {0, 1, 3, 2}, {0, 2, 3, 1}, {1, 2, 3, 0}};
  bool outside = false;
  for (const auto& f : kFaces) {
    const Vector3d& a = s.points[f[0]].w;
    const Vector3d ab = s.points[f[1]].w - a;
    const Vector3d ac = s.points[f[2]].w - a;
    const Vector3d ad = s.points[f[3]].w - a;
    const Vector3d normal = ab.cross(ac);
    const double volume = normal.dot(ad);
    constexpr double kFlat = 1e-13;
    const double flat = kFlat * ab.norm() * ac.norm() * ad.norm();
    const double side = -normal.dot(a);
    if (std::abs(volume) > flat && side * volume >= 0.0) continue;
    outside = true;
    best = Better(best, OnTriangle(s, f[0], f[1], f[2]));
  }
  return outside;
}

/// Finds the feature of the simplex nearest to the origin. Returns false if the origin is inside.
bool FindNearest(const Simplex& s, Nearest& n) {
  switch (s.size) {
    case 1:
      n = OnVertex(s, 0);
      return true;
    case 2:
      n = OnSegment(s, 0, 1);
      return true;
    case 3:
      n = OnTriangle(s, 0, 1, 2);
      return true;
    default:
      return OnTetrahedron(s, n);
  }
}

bool Contains(const Simplex& s, const Vector3d& w) {
  for (int i = 0; i < s.size; ++i) {
    if (s.points[i].w == w) return true;
  }
  return false;
}

/// Returns the direction from B's bounds to A's centre: better than the line between centres if B is large, such as a
/// floor.
Vector3d FirstDirection(const SupportSet& a, const SupportSet& b) {
  Vector3d v = a.centre - a.centre.cwiseMax(b.lower).cwiseMin(b.upper);
  if (v.squaredNorm() == 0.0) v = a.centre - b.centre;
  return v.squaredNorm() == 0.0 ? Vector3d::UnitX() : v;
}

enum class GjkOutcome { kFar, kApart, kOverlap };

/// Recomputes the feature of the hint at the present poses. Returns false if there is none, or if it contains the
/// origin.
bool Recall(const SupportSet& a, const SupportSet& b, const DistanceHint& hint, Simplex& simplex, Nearest& nearest) {
  if (hint.size == 0) return false;
  for (int i = 0; i < hint.size; ++i) {
    DifferencePoint& point = simplex.points[i];
    point.ia = hint.a[i];
    point.ib = hint.b[i];
    point.a = a.Point(point.ia);
    point.b = b.Point(point.ib);
    point.w = point.a - point.b;
  }
  simplex.size = hint.size;
  if (FindNearest(simplex, nearest) && nearest.squared > kTouching * kTouching) return true;
  simplex.size = 0;
  return false;
}

void Remember(GjkOutcome outcome, const Simplex& simplex, const Vector3d& v, DistanceHint& hint) {
  constexpr int kMaxPoints = std::numeric_limits<std::uint16_t>::max();
  hint.size = 0;
  hint.direction = v.cast<float>();
  if (outcome == GjkOutcome::kOverlap) hint.direction.setZero();
  if (outcome != GjkOutcome::kApart) return;
  constexpr int kMaxCorners = 3;
  const int size = std::min(simplex.size, kMaxCorners);
  for (int i = 0; i < size; ++i) {
    const DifferencePoint& point = simplex.points[i];
    if (std::min(point.ia, point.ib) < 0 || std::max(point.ia, point.ib) > kMaxPoints) return;
    hint.a[i] = static_cast<std::uint16_t>(point.ia);
    hint.b[i] = static_cast<std::uint16_t>(point.ib);
  }
  hint.size = static_cast<std::uint8_t>(size);
}

GjkOutcome RunGjk(const SupportSet& a, const SupportSet& b, double cutoff, const DistanceHint* hint, Simplex& simplex,
                  Vector3d& v) {
  double squared = std::numeric_limits<double>::infinity();
  Nearest recalled;
  if (hint != nullptr && Recall(a, b, *hint, simplex, recalled)) {
    Keep(simplex, recalled);
    v = recalled.point;
    squared = recalled.squared;
  } else {
    const bool known = hint != nullptr && hint->direction.squaredNorm() > 0.0F;
    v = known ? Vector3d(hint->direction.cast<double>()) : FirstDirection(a, b);
  }
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const DifferencePoint point = SupportOfDifference(a, b, -v);
    const double vw = v.dot(point.w);
    const double vv = v.squaredNorm();
    // The plane through w with normal v separates the cores by v.w / |v|.
    if (vw > 0.0 && cutoff >= 0.0 && vw * vw >= cutoff * cutoff * vv) return GjkOutcome::kFar;
    if (simplex.size > 0) {
      if (vv - vw <= kRelativeGap * vv + kAbsoluteGap * std::sqrt(vv)) return GjkOutcome::kApart;
      if (Contains(simplex, point.w)) return GjkOutcome::kApart;
    }
    simplex.points[simplex.size] = point;
    simplex.weights[simplex.size] = 0.0;
    ++simplex.size;
    Nearest nearest;
    if (!FindNearest(simplex, nearest)) return GjkOutcome::kOverlap;
    if (nearest.squared >= squared) {  // no further progress because of rounding
      --simplex.size;
      return GjkOutcome::kApart;
    }
    Keep(simplex, nearest);
    v = nearest.point;
    squared = nearest.squared;
    if (squared <= kTouching * kTouching) return GjkOutcome::kOverlap;
  }
  return GjkOutcome::kApart;
}

}  // namespace

bool SignedDistance(const SupportSet& a, const SupportSet& b, double cutoff_m, PairDistance& result,
                    DistanceHint* hint) {
  const double radii = a.radius + b.radius;
  Simplex simplex;
  Vector3d v;
  const GjkOutcome outcome = RunGjk(a, b, cutoff_m + radii, hint, simplex, v);
  if (hint != nullptr) Remember(outcome, simplex, v, *hint);
  if (outcome == GjkOutcome::kFar) return false;
  if (outcome == GjkOutcome::kOverlap) {
    const PairDistance core = ComputePenetration(a, b, simplex);
    if (core.distance_m - radii >= cutoff_m) return false;
    result = core;
  } else {
    const double norm = v.norm();
    if (norm - radii >= cutoff_m) return false;
    result.distance_m = norm;
    result.normal = v / norm;
    result.point_b.setZero();
    for (int i = 0; i < simplex.size; ++i) result.point_b += simplex.weights[i] * simplex.points[i].b;
  }
  result.distance_m -= radii;
  result.point_b += b.radius * result.normal;
  result.point_a = result.point_b + result.distance_m * result.normal;
  return true;
}

}  // namespace legopt

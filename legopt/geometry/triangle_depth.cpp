#include "legopt/geometry/triangle_depth.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace legopt {
namespace {

using Eigen::Vector3d;

constexpr double kApart = -1.0;

/// Plane of a triangle with outward unit normal; the normal is zero for a triangle without area.
struct Plane {
  Vector3d normal = Vector3d::Zero();
  Vector3d point = Vector3d::Zero();

  explicit Plane(const TriangleCorners& t) : point(t[0]) {
    const Vector3d cross = (t[1] - t[0]).cross(t[2] - t[0]);
    const double norm = cross.norm();
    if (norm > 0.0) normal = cross / norm;
  }
  double Height(const Vector3d& p) const { return normal.dot(p - point); }
};

std::array<double, 3> Heights(const Plane& plane, const TriangleCorners& t) {
  return {plane.Height(t[0]), plane.Height(t[1]), plane.Height(t[2])};
}

bool OnOneSide(const std::array<double, 3>& h) {
  return (h[0] > 0.0 && h[1] > 0.0 && h[2] > 0.0) || (h[0] < 0.0 && h[1] < 0.0 && h[2] < 0.0);
}

/// Returns the interval in which a triangle intersects the other's plane: coordinates along the planes' common line.
std::array<double, 2> Cut(const TriangleCorners& t, const std::array<double, 3>& h, const Vector3d& line) {
  std::array<double, 2> cut = {std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  const auto include = [&](double s) {
    cut[0] = std::min(cut[0], s);
    cut[1] = std::max(cut[1], s);
  };
  for (size_t i = 0; i < 3; ++i) {
    const size_t j = (i + 1) % 3;
    if (h[i] == 0.0) include(line.dot(t[i]));
    if ((h[i] < 0.0 && h[j] > 0.0) || (h[i] > 0.0 && h[j] < 0.0)) {
      include(line.dot(t[i]) + (line.dot(t[j]) - line.dot(t[i])) * h[i] / (h[i] - h[j]));
    }
  }
  return cut;
}

/// Returns true if two triangles cross (Moeller's interval test).
bool Cross(const TriangleCorners& a, const Plane& plane_a, const TriangleCorners& b, const Plane& plane_b) {
  const std::array<double, 3> heights_b = Heights(plane_a, b);
  if (OnOneSide(heights_b)) return false;
  const std::array<double, 3> heights_a = Heights(plane_b, a);
  if (OnOneSide(heights_a)) return false;
  const Vector3d line = plane_a.normal.cross(plane_b.normal);
  if (line.isZero(0.0)) return false;
  const std::array<double, 2> cut_a = Cut(a, heights_a, line), cut_b = Cut(b, heights_b, line);
  return cut_a[0] <= cut_b[1] && cut_b[0] <= cut_a[1];
}

/// A triangle clipped by up to three planes.
struct Polygon {
  static constexpr int kMaxCorners = 6;
  std::array<Vector3d, kMaxCorners> corners;
  int size = 0;

  void Add(const Vector3d& corner) {
    if (size < kMaxCorners) corners[static_cast<size_t>(size++)] = corner;
  }
};

/// Clips a polygon to n . (p - point) <= 0.
Polygon Clip(const Polygon& polygon, const Vector3d& n, const Vector3d& point) {
  Polygon rest;
  for (int i = 0; i < polygon.size; ++i) {
    const Vector3d& p = polygon.corners[static_cast<size_t>(i)];
    const Vector3d& q = polygon.corners[static_cast<size_t>((i + 1) % polygon.size)];
    const double hp = n.dot(p - point), hq = n.dot(q - point);
    if (hp <= 0.0) rest.Add(p);
    if ((hp < 0.0 && hq > 0.0) || (hp > 0.0 && hq < 0.0)) rest.Add(p + (q - p) * (hp / (hp - hq)));
  }
  return rest;
}

/// Returns the depth of `t`, clipped to the prism over `face`, behind the plane; minus infinity if nothing remains.
/// `deepest` receives the deepest point.
double DepthBehind(const TriangleCorners& face, const Plane& plane, const TriangleCorners& t,
                   Vector3d* deepest = nullptr) {
  Polygon polygon;
  for (const Vector3d& corner : t) polygon.Add(corner);
  for (size_t i = 0; i < 3 && polygon.size > 0; ++i) {
    polygon = Clip(polygon, (face[(i + 1) % 3] - face[i]).cross(plane.normal), face[i]);
  }
  double depth = -std::numeric_limits<double>::infinity();
  for (int i = 0; i < polygon.size; ++i) {
    const Vector3d& corner = polygon.corners[static_cast<size_t>(i)];
    const double behind = -plane.Height(corner);
    if (deepest != nullptr && behind > depth) *deepest = corner;
    depth = std::max(depth, behind);
  }
  return depth;
}

TriangleCorners CornersOf(const TriangleMesh& mesh, size_t triangle) {
  TriangleCorners corners;
  for (size_t k = 0; k < corners.size(); ++k) {
    corners[k] = mesh.vertices[static_cast<size_t>(mesh.triangles[triangle][k])];
  }
  return corners;
}

}  // namespace

double TriangleDepth(const TriangleCorners& a, const TriangleCorners& b) {
  const Plane plane_a(a), plane_b(b);
  if (!Cross(a, plane_a, b, plane_b)) return kApart;
  const double depth = std::min(DepthBehind(a, plane_a, b), DepthBehind(b, plane_b, a));
  return std::isfinite(depth) ? std::max(depth, 0.0) : kApart;
}

namespace {

/// Calls action(triangle of A, triangle of B in the frame of A) for all pairs with overlapping boxes.
template <class Action>
void ForEachNearPair(const TriangleMesh& a, const TriangleBvh& bvh_a, const TriangleMesh& b,
                     const Eigen::Isometry3d& X_AB, Action action) {
  for (size_t t = 0; t < b.triangles.size(); ++t) {
    TriangleCorners corners = CornersOf(b, t);
    Eigen::AlignedBox3d box;
    for (Vector3d& corner : corners) {
      corner = X_AB * corner;
      box.extend(corner);
    }
    bvh_a.AnyOverlapping(box, [&](int other) {
      action(CornersOf(a, static_cast<size_t>(other)), corners);
      return false;
    });
  }
}

}  // namespace

double MeshDepth(const TriangleMesh& a, const TriangleBvh& bvh_a, const TriangleMesh& b,
                 const Eigen::Isometry3d& X_AB) {
  double deepest = kApart;
  ForEachNearPair(a, bvh_a, b, X_AB, [&](const TriangleCorners& of_a, const TriangleCorners& of_b) {
    deepest = std::max(deepest, TriangleDepth(of_a, of_b));
  });
  return deepest;
}

MeshCrossing DeepestCrossing(const TriangleMesh& a, const TriangleBvh& bvh_a, const TriangleMesh& b,
                             const Eigen::Isometry3d& X_AB) {
  MeshCrossing deepest;
  TriangleCorners triangle_a, triangle_b;
  ForEachNearPair(a, bvh_a, b, X_AB, [&](const TriangleCorners& of_a, const TriangleCorners& of_b) {
    const double depth = TriangleDepth(of_a, of_b);
    if (depth <= deepest.depth_m) return;
    deepest.depth_m = depth;
    triangle_a = of_a;
    triangle_b = of_b;
  });
  if (deepest.depth_m < 0.0) return deepest;
  const Plane plane_a(triangle_a), plane_b(triangle_b);
  Vector3d of_a = triangle_a[0], of_b = triangle_b[0];
  const double b_behind_a = DepthBehind(triangle_a, plane_a, triangle_b, &of_b);
  const double a_behind_b = DepthBehind(triangle_b, plane_b, triangle_a, &of_a);
  if (b_behind_a <= a_behind_b) {
    deepest.point_b = of_b;
    deepest.point_a = of_b + deepest.depth_m * plane_a.normal;
  } else {
    deepest.point_a = of_a;
    deepest.point_b = of_a + deepest.depth_m * plane_b.normal;
  }
  return deepest;
}

}  // namespace legopt

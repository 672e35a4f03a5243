#include "legopt/geometry/closed_bodies.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "legopt/geometry/mesh_components.h"
#include "legopt/geometry/mesh_faults.h"

namespace legopt {
namespace {

using Eigen::Vector3d;

TriangleMesh ClosedComponents(const TriangleMesh& mesh, std::vector<ClosedBodies::Body>* bodies) {
  TriangleMesh closed;
  for (const TriangleMesh& component : SplitIntoComponents(mesh)) {
    if (!IsClosed(component)) continue;
    const int first = static_cast<int>(closed.vertices.size());
    ClosedBodies::Body& body = bodies->emplace_back();
    body.first_vertex = first;
    body.num_vertices = static_cast<int>(component.vertices.size());
    for (const Vector3d& vertex : component.vertices) {
      body.bounds.extend(vertex);
      closed.vertices.push_back(vertex);
    }
    for (const auto& [a, b, c] : component.triangles) closed.triangles.push_back({first + a, first + b, first + c});
  }
  return closed;
}

/// Returns the contribution of the side from `a` to `b` to the winding number about `p` in plan: +1 if it crosses the
/// half line from p along x upwards in y, -1 downwards. Both triangles of an edge get opposite values of the same
/// computation.
int SideWinding(const Vector3d& a, const Vector3d& b, const Vector3d& p) {
  const bool a_below = a.y() <= p.y(), b_below = b.y() <= p.y();
  if (a_below == b_below) return 0;
  const Vector3d& low = a_below ? a : b;
  const Vector3d& high = a_below ? b : a;
  const double left = (high.x() - low.x()) * (p.y() - low.y()) - (p.x() - low.x()) * (high.y() - low.y());
  if (!(left > 0.0)) return 0;
  return a_below ? 1 : -1;
}

/// Returns true if a triangle whose projection contains that of `p` passes above p. A numerically undefined height
/// belongs to a plane that is almost vertical: then p is closer to the triangle than any tolerance, or the triangle is
/// entirely above or below p.
bool PassesAbove(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& p) {
  const Vector3d normal = (b - a).cross(c - a);
  const double low = std::min({a.z(), b.z(), c.z()}), high = std::max({a.z(), b.z(), c.z()});
  const double height = a.z() - (normal.x() * (p.x() - a.x()) + normal.y() * (p.y() - a.y())) / normal.z();
  return (std::isfinite(height) ? std::clamp(height, low, high) : high) > p.z();
}

double DistanceToSegment(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
  const Vector3d ab = b - a;
  const double length2 = ab.squaredNorm();
  const double t = length2 > 0.0 ? std::clamp((p - a).dot(ab) / length2, 0.0, 1.0) : 0.0;
  return (p - a - t * ab).norm();
}

/// Returns the distance of a point from a triangle, which may have no area.
double DistanceToTriangle(const Vector3d& p, const std::array<Vector3d, 3>& corners) {
  const auto& [a, b, c] = corners;
  const Vector3d normal = (b - a).cross(c - a);
  const auto inside = [&](const Vector3d& from, const Vector3d& to) {
    return normal.dot((to - from).cross(p - from)) >= 0.0;
  };
  const double norm = normal.norm();
  if (norm > 0.0 && inside(a, b) && inside(b, c) && inside(c, a)) return std::abs(normal.dot(p - a)) / norm;
  return std::min({DistanceToSegment(p, a, b), DistanceToSegment(p, b, c), DistanceToSegment(p, c, a)});
}

}  // namespace

ClosedBodies::ClosedBodies(const TriangleMesh& mesh) : mesh_(ClosedComponents(mesh, &bodies_)), bvh_(mesh_) {
  for (const Body& body : bodies_) bounds_.extend(body.bounds);
}

double ClosedBodies::Depth(const Vector3d& point) const {
  return bounds_.contains(point) && Contains(point) ? DistanceToSurface(point) : 0.0;
}

bool ClosedBodies::Contains(const Vector3d& point) const {
  constexpr double kHair = 1e-6;  // m; margin for triangles that contain the point only after rounding
  int winding = 0;
  const Eigen::AlignedBox3d ray(point - Vector3d(kHair, kHair, 0.0),
                                Vector3d(point.x() + kHair, point.y() + kHair, bounds_.max().z()));
  bvh_.AnyOverlapping(ray, [&](int t) {
    const auto& corners = mesh_.triangles[static_cast<size_t>(t)];
    const Vector3d& a = mesh_.vertices[static_cast<size_t>(corners[0])];
    const Vector3d& b = mesh_.vertices[static_cast<size_t>(corners[1])];
    const Vector3d& c = mesh_.vertices[static_cast<size_t>(corners[2])];
    const int turns = SideWinding(a, b, point) + SideWinding(b, c, point) + SideWinding(c, a, point);
    if (turns != 0 && PassesAbove(a, b, c, point)) winding += turns;
    return false;
  });
  return winding != 0;
}

/// Searches growing boxes about the point, since most queried points are close to the surface.
double ClosedBodies::DistanceToSurface(const Vector3d& point) const {
  constexpr double kFirst = 2e-3;  // m
  double nearest = std::numeric_limits<double>::infinity();
  for (double reach = kFirst; nearest > reach; reach *= 2.0) {
    const Eigen::AlignedBox3d box(point.array() - reach, point.array() + reach);
    bvh_.AnyOverlapping(box, [&](int t) {
      std::array<Vector3d, 3> corners;
      for (size_t k = 0; k < corners.size(); ++k) {
        corners[k] = mesh_.vertices[static_cast<size_t>(mesh_.triangles[static_cast<size_t>(t)][k])];
      }
      nearest = std::min(nearest, DistanceToTriangle(point, corners));
      return false;
    });
  }
  return nearest;
}

}  // namespace legopt

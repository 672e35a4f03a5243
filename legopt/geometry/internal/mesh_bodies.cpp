#include "legopt/geometry/internal/mesh_bodies.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <numeric>
#include <span>
#include <utility>

namespace legopt {
namespace {

/// One side of a triangle; `key` sorts equal edges together, whatever their direction.
struct EdgeUse {
  std::uint64_t key;
  int triangle;
  int opposite;  ///< vertex of the triangle opposite the edge
  bool forward;  ///< runs from the smaller to the larger vertex index
};

class DisjointSets {
 public:
  explicit DisjointSets(size_t size) : parent_(size) { std::iota(parent_.begin(), parent_.end(), 0); }
  int Find(int i) {
    while (parent_[static_cast<size_t>(i)] != i) {
      int& parent = parent_[static_cast<size_t>(i)];
      parent = parent_[static_cast<size_t>(parent)];
      i = parent;
    }
    return i;
  }
  void Join(int a, int b) { parent_[static_cast<size_t>(Find(b))] = Find(a); }

 private:
  std::vector<int> parent_;
};

std::vector<EdgeUse> SortedEdges(const TriangleMesh& mesh) {
  std::vector<EdgeUse> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& corners = mesh.triangles[t];
    for (size_t k = 0; k < 3; ++k) {
      const auto a = static_cast<std::uint64_t>(corners[k]);
      const auto b = static_cast<std::uint64_t>(corners[(k + 1) % 3]);
      edges.push_back({(std::min(a, b) << 32) | std::max(a, b), static_cast<int>(t), corners[(k + 2) % 3], a < b});
    }
  }
  std::stable_sort(edges.begin(), edges.end(), [](const auto& a, const auto& b) { return a.key < b.key; });
  return edges;
}

/// Returns the angle about the edge from triangle `from` through its material to `to`, in (0, 2 pi].
double AngleThroughMaterial(const TriangleMesh& mesh, const EdgeUse& from, const EdgeUse& to) {
  const auto at = [&](std::uint64_t i) -> const Eigen::Vector3d& { return mesh.vertices[i]; };
  const Eigen::Vector3d a = at(from.key >> 32);
  const Eigen::Vector3d b = at(from.key & 0xFFFFFFFFU);
  const Eigen::Vector3d axis = (from.forward ? b - a : a - b).normalized();
  const auto across = [&](const EdgeUse& use) {
    const Eigen::Vector3d d = at(static_cast<std::uint64_t>(use.opposite)) - a;
    return Eigen::Vector3d(d - axis * axis.dot(d)).normalized();
  };
  const Eigen::Vector3d u = across(from);
  const Eigen::Vector3d inward = u.cross(axis);  // minus the outward normal axis x u
  const Eigen::Vector3d d = across(to);
  const double angle = std::atan2(d.dot(inward), d.dot(u));
  constexpr double kCoincident = 1e-6;
  return angle > kCoincident ? angle : angle + 2.0 * std::numbers::pi;
}

/// Joins the triangles that share an edge and bound the same solid.
void JoinAtEdge(const TriangleMesh& mesh, std::span<const EdgeUse> uses, DisjointSets& sets) {
  if (uses.size() == 2) {
    sets.Join(uses[0].triangle, uses[1].triangle);
    return;
  }
  for (const EdgeUse& from : uses) {
    if (!from.forward) continue;
    const EdgeUse* nearest = nullptr;
    double smallest = 0.0;
    for (const EdgeUse& to : uses) {
      if (to.forward) continue;
      const double turn = AngleThroughMaterial(mesh, from, to);
      if (nearest == nullptr || turn < smallest) {
        nearest = &to;
        smallest = turn;
      }
    }
    if (nearest != nullptr) sets.Join(from.triangle, nearest->triangle);
  }
}

}  // namespace

std::vector<std::vector<int>> GroupTrianglesByComponent(const TriangleMesh& mesh) {
  const std::vector<EdgeUse> edges = SortedEdges(mesh);
  DisjointSets sets(mesh.triangles.size());
  for (size_t begin = 0; begin < edges.size();) {
    size_t end = begin + 1;
    while (end < edges.size() && edges[end].key == edges[begin].key) ++end;
    JoinAtEdge(mesh, std::span(edges).subspan(begin, end - begin), sets);
    begin = end;
  }
  std::vector<int> component_of_root(mesh.triangles.size(), -1);
  std::vector<std::vector<int>> members;
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    int& component = component_of_root[static_cast<size_t>(sets.Find(static_cast<int>(t)))];
    if (component < 0) {
      component = static_cast<int>(members.size());
      members.emplace_back();
    }
    members[static_cast<size_t>(component)].push_back(static_cast<int>(t));
  }
  return members;
}

std::vector<TriangleMesh> SplitIntoComponents(const TriangleMesh& mesh) {
  std::vector<TriangleMesh> components;
  std::vector<int> local(mesh.vertices.size(), -1);
  for (const std::vector<int>& triangles : GroupTrianglesByComponent(mesh)) {
    TriangleMesh& part = components.emplace_back();
    for (int t : triangles) {
      std::array<int, 3> corners = mesh.triangles[static_cast<size_t>(t)];
      for (int& corner : corners) {
        int& index = local[static_cast<size_t>(corner)];
        if (index < 0) {
          index = static_cast<int>(part.vertices.size());
          part.vertices.push_back(mesh.vertices[static_cast<size_t>(corner)]);
        }
        corner = index;
      }
      part.triangles.push_back(corners);
    }
    for (int t : triangles) {
      for (int corner : mesh.triangles[static_cast<size_t>(t)]) local[static_cast<size_t>(corner)] = -1;
    }
  }
  return components;
}

namespace {

using Eigen::Vector3d;

constexpr double kNearlyClosed = 0.01;  // maximum share of open edges for which the sign of the volume is meaningful

double SixVolumes(const TriangleMesh& mesh) {
  double sum = 0.0;
  const auto at = [&](int i) -> const Vector3d& { return mesh.vertices[static_cast<size_t>(i)]; };
  const Vector3d origin = mesh.vertices.empty() ? Vector3d(0.0, 0.0, 0.0) : mesh.vertices.front();
  for (const auto& [a, b, c] : mesh.triangles) sum += (at(a) - origin).dot((at(b) - origin).cross(at(c) - origin));
  return sum;
}

struct EdgeCount {
  int all = 0;
  int open = 0;
};

EdgeCount CountEdges(const TriangleMesh& mesh) {
  struct Use {
    std::pair<int, int> edge;  // smaller vertex index first
    int direction = 0;         // 1 from the smaller to the larger index, else -1
  };
  std::vector<Use> uses;
  uses.reserve(3 * mesh.triangles.size());
  for (const auto& triangle : mesh.triangles) {
    for (size_t k = 0; k < 3; ++k) {
      const int a = triangle[k];
      const int b = triangle[(k + 1) % 3];
      uses.push_back({{std::min(a, b), std::max(a, b)}, a < b ? 1 : -1});
    }
  }
  std::sort(uses.begin(), uses.end(), [](const Use& a, const Use& b) { return a.edge < b.edge; });
  EdgeCount count;
  for (size_t i = 0; i < uses.size();) {
    int balance = 0;
    const std::pair<int, int> edge = uses[i].edge;
    for (; i < uses.size() && uses[i].edge == edge; ++i) balance += uses[i].direction;
    ++count.all;
    count.open += balance != 0 ? 1 : 0;
  }
  return count;
}

bool IsInverted(const TriangleMesh& component, const EdgeCount& edges) {
  return edges.open <= kNearlyClosed * edges.all && SixVolumes(component) < 0.0;
}

}  // namespace

bool IsClosed(const TriangleMesh& mesh) { return CountEdges(mesh).open == 0; }

MeshFaults FindMeshFaults(const TriangleMesh& mesh) {
  const EdgeCount edges = CountEdges(mesh);
  MeshFaults faults{.edges = edges.all, .open_edges = edges.open};
  for (const TriangleMesh& component : SplitIntoComponents(mesh)) {
    const EdgeCount own = CountEdges(component);
    ++faults.components;
    faults.open_components += own.open > 0 ? 1 : 0;
    faults.inverted_components += IsInverted(component, own) ? 1 : 0;
  }
  return faults;
}

TriangleMesh FlipInvertedComponents(const TriangleMesh& mesh) {
  TriangleMesh turned;
  for (TriangleMesh& component : SplitIntoComponents(mesh)) {
    const bool inverted = IsInverted(component, CountEdges(component));
    const int first = static_cast<int>(turned.vertices.size());
    turned.vertices.insert(turned.vertices.end(), component.vertices.begin(), component.vertices.end());
    for (auto [a, b, c] : component.triangles) {
      if (inverted) std::swap(b, c);
      turned.triangles.push_back({first + a, first + b, first + c});
    }
  }
  return turned;
}

namespace {

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

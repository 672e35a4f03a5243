#include "legopt/geometry/mesh_components.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <span>

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

std::vector<TriangleMesh> SplitIntoComponents(const TriangleMesh& mesh) {
  const std::vector<EdgeUse> edges = SortedEdges(mesh);
  DisjointSets sets(mesh.triangles.size());
  for (size_t begin = 0; begin < edges.size();) {
    size_t end = begin + 1;
    while (end < edges.size() && edges[end].key == edges[begin].key) ++end;
    JoinAtEdge(mesh, std::span(edges).subspan(begin, end - begin), sets);
    begin = end;
  }
  std::vector<int> component_of_root(mesh.triangles.size(), -1);
  std::vector<TriangleMesh> components;
  std::vector<std::vector<int>> members;
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    int& component = component_of_root[static_cast<size_t>(sets.Find(static_cast<int>(t)))];
    if (component < 0) {
      component = static_cast<int>(members.size());
      members.emplace_back();
    }
    members[static_cast<size_t>(component)].push_back(static_cast<int>(t));
  }
  std::vector<int> local(mesh.vertices.size(), -1);
  for (const std::vector<int>& triangles : members) {
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

}  // namespace legopt

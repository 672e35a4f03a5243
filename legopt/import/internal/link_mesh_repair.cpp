#include "legopt/import/internal/link_mesh_repair.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <tuple>
#include <utility>
#include <vector>

#include "legopt/geometry/internal/convex_shape.h"
#include "legopt/geometry/internal/mesh_bodies.h"

namespace legopt {
namespace {

using Eigen::Vector3d;
using Edge = std::pair<int, int>;  ///< vertices, first < second

constexpr double kWeld_m = 1e-5;
constexpr double kNearlyClosed = 0.01;

/// Welds vertices that lie in neighbouring cells of a grid and at most kWeld_m apart; removes triangles that collapse.
int Weld(TriangleMesh* mesh) {
  std::map<std::array<std::int64_t, 3>, std::vector<int>> cells;
  std::vector<int> index;
  std::vector<Vector3d> kept;
  for (const Vector3d& vertex : mesh->vertices) {
    std::array<std::int64_t, 3> cell{};
    for (int axis = 0; axis < 3; ++axis) {
      cell[static_cast<size_t>(axis)] = static_cast<std::int64_t>(std::floor(vertex[axis] / kWeld_m));
    }
    int found = -1;
    for (int near = 0; near < 27 && found < 0; ++near) {
      const auto place = cells.find({cell[0] + near % 3 - 1, cell[1] + near / 3 % 3 - 1, cell[2] + near / 9 - 1});
      if (place == cells.end()) continue;
      for (const int other : place->second) {
        if ((kept[static_cast<size_t>(other)] - vertex).norm() <= kWeld_m) {
          found = other;
          break;
        }
      }
    }
    if (found < 0) {
      found = static_cast<int>(kept.size());
      cells[cell].push_back(found);
      kept.push_back(vertex);
    }
    index.push_back(found);
  }
  const int welded = static_cast<int>(mesh->vertices.size() - kept.size());
  if (welded == 0) return 0;
  mesh->vertices = std::move(kept);
  for (auto& triangle : mesh->triangles) {
    for (int& corner : triangle) corner = index[static_cast<size_t>(corner)];
  }
  std::erase_if(mesh->triangles, [](const auto& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
  return welded;
}

Edge EdgeOf(const std::array<int, 3>& triangle, size_t side) {
  return std::minmax({triangle[side], triangle[(side + 1) % 3]});
}

bool RunsForward(const std::array<int, 3>& triangle, const Edge& edge) {
  for (size_t side = 0; side < 3; ++side) {
    if (triangle[side] == edge.first && triangle[(side + 1) % 3] == edge.second) return true;
  }
  return false;
}

/// A set of triangles connected by edges that exactly two triangles of the mesh share.
struct Body {
  std::vector<int> triangles;
  double six_volumes = 0.0;
  bool closed_enough = false;  ///< at most 1 % of its edges are used by an odd number of its triangles
  Eigen::AlignedBox3d box;
  std::unique_ptr<ClosedBodies> solid;  ///< made when it is first needed
};

class Orienter {
 public:
  explicit Orienter(TriangleMesh* mesh) : mesh_(*mesh) {
    for (size_t t = 0; t < mesh_.triangles.size(); ++t) {
      for (size_t side = 0; side < 3; ++side) {
        uses_[EdgeOf(mesh_.triangles[t], side)].push_back(static_cast<int>(t));
      }
    }
  }

  /// Orients all bodies; returns the numbers of bodies and of those with turned triangles.
  std::pair<int, int> Run() {
    const std::vector<std::array<int, 3>> before = mesh_.triangles;
    CollectBodies();
    std::vector<size_t> inverted;
    for (size_t i = 0; i < bodies_.size(); ++i) {
      if (bodies_[i].closed_enough && bodies_[i].six_volumes < 0.0 && !IsCavity(bodies_[i])) inverted.push_back(i);
    }
    for (const size_t i : inverted) Turn(&bodies_[i]);
    int turned = 0;
    for (const Body& body : bodies_) {
      turned += std::ranges::any_of(body.triangles, [&](int t) {
        return mesh_.triangles[static_cast<size_t>(t)] != before[static_cast<size_t>(t)];
      });
    }
    return {static_cast<int>(bodies_.size()), turned};
  }

 private:
  void CollectBodies() {
    std::vector<bool> seen(mesh_.triangles.size(), false);
    for (size_t seed = 0; seed < seen.size(); ++seed) {
      if (seen[seed]) continue;
      seen[seed] = true;
      Body body;
      body.triangles.push_back(static_cast<int>(seed));
      for (size_t next = 0; next < body.triangles.size(); ++next) Spread(body.triangles[next], &seen, &body);
      Measure(&body);
      bodies_.push_back(std::move(body));
    }
  }

  /// Adds the neighbours of a triangle, wound like it.
  void Spread(int from, std::vector<bool>* seen, Body* body) {
    const std::array<int, 3> triangle = mesh_.triangles[static_cast<size_t>(from)];
    for (size_t side = 0; side < 3; ++side) {
      const Edge edge = EdgeOf(triangle, side);
      const std::vector<int>& uses = uses_.at(edge);
      if (uses.size() != 2) continue;
      const int other = uses[0] == from ? uses[1] : uses[0];
      if ((*seen)[static_cast<size_t>(other)]) continue;
      (*seen)[static_cast<size_t>(other)] = true;
      auto& neighbour = mesh_.triangles[static_cast<size_t>(other)];
      if (RunsForward(neighbour, edge) == RunsForward(triangle, edge)) std::swap(neighbour[1], neighbour[2]);
      body->triangles.push_back(other);
    }
  }

  void Measure(Body* body) const {
    const Vector3d origin = At(body->triangles.front(), 0);
    std::map<Edge, int> count;
    for (const int t : body->triangles) {
      const Vector3d a = At(t, 0) - origin, b = At(t, 1) - origin, c = At(t, 2) - origin;
      body->six_volumes += a.dot(b.cross(c));
      for (size_t k = 0; k < 3; ++k) {
        body->box.extend(At(t, k));
        ++count[EdgeOf(mesh_.triangles[static_cast<size_t>(t)], k)];
      }
    }
    const auto open = std::ranges::count_if(count, [](const auto& entry) { return entry.second % 2 != 0; });
    body->closed_enough = static_cast<double>(open) <= kNearlyClosed * static_cast<double>(count.size());
  }

  /// Returns true if the body lies inside another one with positive volume.
  bool IsCavity(const Body& body) {
    const Vector3d point = At(body.triangles.front(), 0);
    return std::ranges::any_of(bodies_, [&](Body& other) {
      if (!other.closed_enough || other.six_volumes <= 0.0 || !other.box.contains(body.box)) return false;
      if (other.solid == nullptr) other.solid = std::make_unique<ClosedBodies>(ShellOf(other));
      return other.solid->Depth(point) > 0.0;
    });
  }

  TriangleMesh ShellOf(const Body& body) const {
    TriangleMesh shell;
    std::map<int, int> local;
    for (const int t : body.triangles) {
      std::array<int, 3> corners = mesh_.triangles[static_cast<size_t>(t)];
      for (int& corner : corners) {
        const auto [place, fresh] = local.try_emplace(corner, static_cast<int>(shell.vertices.size()));
        if (fresh) shell.vertices.push_back(mesh_.vertices[static_cast<size_t>(corner)]);
        corner = place->second;
      }
      shell.triangles.push_back(corners);
    }
    return shell;
  }

  void Turn(Body* body) {
    for (const int t : body->triangles) {
      auto& triangle = mesh_.triangles[static_cast<size_t>(t)];
      std::swap(triangle[1], triangle[2]);
    }
    body->six_volumes = -body->six_volumes;
  }

  const Vector3d& At(int triangle, size_t corner) const {
    return mesh_.vertices[static_cast<size_t>(mesh_.triangles[static_cast<size_t>(triangle)][corner])];
  }

  TriangleMesh& mesh_;
  std::map<Edge, std::vector<int>> uses_;
  std::vector<Body> bodies_;
};

}  // namespace

RepairedLinkMesh RepairLinkMesh(const TriangleMesh& mesh) {
  RepairedLinkMesh result{.mesh = mesh};
  if (!IsClosed(mesh)) {
    result.welded = Weld(&result.mesh);
    if (result.mesh.triangles.empty()) {  // smaller than the tolerance
      result.mesh = mesh;
      result.welded = 0;
    }
  }
  std::tie(result.bodies, result.turned) = Orienter(&result.mesh).Run();
  result.flat = ComputeHull(result.mesh.vertices).flat();
  return result;
}

}  // namespace legopt

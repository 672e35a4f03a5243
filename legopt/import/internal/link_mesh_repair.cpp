#include "legopt/import/internal/link_mesh_repair.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <tuple>
#include <unordered_map>
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

using Cell = std::array<std::int64_t, 3>;

struct CellHash {
  std::size_t operator()(const Cell& cell) const {
    constexpr std::uint64_t kFactor = 0x9E3779B97F4A7C15ULL;  // mixes the bits: 2^64 / golden ratio
    std::uint64_t hash = 0;
    for (const std::int64_t part : cell) hash = (hash ^ static_cast<std::uint64_t>(part)) * kFactor;
    return hash ^ (hash >> 32U);
  }
};

/// Welds each vertex to the first one that lies at most kWeld_m from it; removes triangles that collapse.
int Weld(TriangleMesh* mesh) {
  constexpr double kCell_m = 64.0 * kWeld_m;  // most vertices have neighbours in one cell only
  std::unordered_map<Cell, std::vector<int>, CellHash> cells;
  std::vector<int> index;
  std::vector<Vector3d> kept;
  const auto cell_of = [](const Vector3d& p) {
    const auto along = [&](int axis) { return static_cast<std::int64_t>(std::floor(p[axis] / kCell_m)); };
    return Cell{along(0), along(1), along(2)};
  };
  for (const Vector3d& vertex : mesh->vertices) {
    const Cell cell = cell_of(vertex), low = cell_of(vertex - Vector3d::Constant(kWeld_m)),
               high = cell_of(vertex + Vector3d::Constant(kWeld_m));
    int found = -1;
    for (std::int64_t x = low[0]; x <= high[0]; ++x) {
      for (std::int64_t y = low[1]; y <= high[1]; ++y) {
        for (std::int64_t z = low[2]; z <= high[2]; ++z) {
          const auto place = cells.find({x, y, z});
          if (place == cells.end()) continue;
          for (const int other : place->second) {
            const bool near = (kept[static_cast<size_t>(other)] - vertex).norm() <= kWeld_m;
            if (near && (found < 0 || other < found)) found = other;
          }
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
    struct Use {
      Edge edge;
      size_t place = 0;  ///< 3 x triangle + side
    };
    std::vector<Use> uses;
    uses.reserve(3 * mesh_.triangles.size());
    for (size_t t = 0; t < mesh_.triangles.size(); ++t) {
      for (size_t side = 0; side < 3; ++side) uses.push_back({EdgeOf(mesh_.triangles[t], side), 3 * t + side});
    }
    std::ranges::sort(uses, {}, &Use::edge);
    neighbours_.assign(uses.size(), -1);
    for (size_t i = 0, end = 0; i < uses.size(); i = end) {
      while (end < uses.size() && uses[end].edge == uses[i].edge) ++end;
      if (end - i != 2) continue;
      neighbours_[uses[i].place] = static_cast<int>(uses[i + 1].place / 3);
      neighbours_[uses[i + 1].place] = static_cast<int>(uses[i].place / 3);
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
      const int other = neighbours_[3 * static_cast<size_t>(from) + side];
      if (other < 0 || (*seen)[static_cast<size_t>(other)]) continue;
      (*seen)[static_cast<size_t>(other)] = true;
      auto& neighbour = mesh_.triangles[static_cast<size_t>(other)];
      if (RunsForward(neighbour, edge) == RunsForward(triangle, edge)) TurnTriangle(other);
      body->triangles.push_back(other);
    }
  }

  void Measure(Body* body) const {
    const Vector3d origin = At(body->triangles.front(), 0);
    std::vector<Edge> edges;
    for (const int t : body->triangles) {
      const Vector3d a = At(t, 0) - origin, b = At(t, 1) - origin, c = At(t, 2) - origin;
      body->six_volumes += a.dot(b.cross(c));
      for (size_t k = 0; k < 3; ++k) {
        body->box.extend(At(t, k));
        edges.push_back(EdgeOf(mesh_.triangles[static_cast<size_t>(t)], k));
      }
    }
    std::ranges::sort(edges);
    int distinct = 0, open = 0;
    for (size_t i = 0, end = 0; i < edges.size(); i = end) {
      while (end < edges.size() && edges[end] == edges[i]) ++end;
      ++distinct;
      open += static_cast<int>((end - i) % 2);
    }
    body->closed_enough = open <= kNearlyClosed * distinct;
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
    for (const int t : body->triangles) TurnTriangle(t);
    body->six_volumes = -body->six_volumes;
  }

  /// Corners a, b, c become a, c, b: the first and the last side change places.
  void TurnTriangle(int triangle) {
    const auto t = static_cast<size_t>(triangle);
    std::swap(mesh_.triangles[t][1], mesh_.triangles[t][2]);
    std::swap(neighbours_[3 * t], neighbours_[3 * t + 2]);
  }

  const Vector3d& At(int triangle, size_t corner) const {
    return mesh_.vertices[static_cast<size_t>(mesh_.triangles[static_cast<size_t>(triangle)][corner])];
  }

  TriangleMesh& mesh_;
  std::vector<int> neighbours_;  ///< triangle at each side, if it is the only other one there, else -1
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

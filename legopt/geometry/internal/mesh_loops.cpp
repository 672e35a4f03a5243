#include "legopt/geometry/internal/mesh_loops.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <span>

#include "legopt/geometry/internal/polygon_triangulation.h"

namespace legopt {

using Eigen::Vector3d;

std::vector<RimEdge> RimOf(const MarkedMesh& mesh, const std::vector<int>& patch) {
  std::vector<RimEdge> rim;
  ForEachEdge(EdgesOf(mesh, patch), [&](std::span<const MarkedEdge> uses) {
    int balance = 0;
    for (const MarkedEdge& use : uses) balance += use.forward ? 1 : -1;
    for (const MarkedEdge& use : uses) {
      if (balance == 0 || use.forward != (balance > 0)) continue;
      balance += use.forward ? -1 : 1;
      const auto& corners = mesh.triangles[static_cast<size_t>(use.triangle)];
      rim.push_back(
          {corners[static_cast<size_t>(use.corner)], corners[static_cast<size_t>((use.corner + 1) % 3)], use.triangle});
    }
  });
  return rim;
}

std::vector<std::vector<int>> TraceLoops(const std::vector<RimEdge>& rim) {
  std::map<int, std::vector<int>> next;  // against the direction of the triangles
  for (const RimEdge& edge : rim) next[edge.to].push_back(edge.from);
  std::vector<std::vector<int>> loops;
  for (auto& [start, ways] : next) {
    while (!ways.empty()) {
      std::vector<int> path = {start};
      std::map<int, size_t> place = {{start, 0}};
      while (!path.empty()) {
        auto& onward = next[path.back()];
        if (onward.empty()) {
          if (path.size() == 1) break;
          return {};
        }
        const int vertex = onward.back();
        onward.pop_back();
        const auto found = place.find(vertex);
        if (found == place.end()) {
          place[vertex] = path.size();
          path.push_back(vertex);
          continue;
        }
        const auto begin = path.begin() + static_cast<std::ptrdiff_t>(found->second);
        std::vector<int> loop(begin, path.end());
        for (size_t k = found->second + 1; k < path.size(); ++k) place.erase(path[k]);
        path.resize(found->second + 1);
        if (loop.size() < 3) return {};
        loops.push_back(std::move(loop));
      }
    }
  }
  return loops;
}

MeshLoop MeasureLoop(const MarkedMesh& mesh, std::vector<int> vertices) {
  MeshLoop loop;
  loop.vertices = std::move(vertices);
  const size_t n = loop.vertices.size();
  Eigen::AlignedBox3d box;
  for (const int v : loop.vertices) {
    loop.centre += mesh.at(v) / static_cast<double>(n);
    box.extend(mesh.at(v));
  }
  Vector3d twice_area = Vector3d::Zero();
  for (size_t k = 0; k < n; ++k) {
    twice_area += (mesh.at(loop.vertices[k]) - loop.centre).cross(mesh.at(loop.vertices[(k + 1) % n]) - loop.centre);
  }
  loop.diagonal_m = box.diagonal().norm();
  loop.area_m2 = 0.5 * twice_area.norm();
  if (loop.area_m2 > 0.0) loop.normal = twice_area.normalized();
  for (const int v : loop.vertices) {
    loop.deviation_m = std::max(loop.deviation_m, std::abs((mesh.at(v) - loop.centre).dot(loop.normal)));
  }
  return loop;
}

std::pair<Vector3d, Vector3d> SpanOf(const Vector3d& normal) {
  const Vector3d x = normal.unitOrthogonal();
  return {x, normal.cross(x)};
}

int SmallestAround(const MarkedMesh& mesh, const std::vector<MeshLoop>& loops, size_t inner, double tolerance_m) {
  const MeshLoop& own = loops[inner];
  int found = -1;
  constexpr double kParallel = 0.9999, kPlanar = 1e-4;
  for (size_t i = 0; i < loops.size(); ++i) {
    const MeshLoop& other = loops[i];
    const double tolerance = std::max({tolerance_m, own.deviation_m, kPlanar * other.diagonal_m});
    if (i == inner || own.normal.dot(other.normal) > -kParallel || other.area_m2 <= own.area_m2 ||
        std::abs((own.centre - other.centre).dot(other.normal)) > tolerance) {
      continue;
    }
    const auto [x, y] = SpanOf(other.normal);
    std::vector<Eigen::Vector2d> points;
    std::vector<int> ring;
    for (const int v : other.vertices) {
      ring.push_back(static_cast<int>(points.size()));
      points.emplace_back(x.dot(mesh.at(v)), y.dot(mesh.at(v)));
    }
    const Vector3d& p = mesh.at(own.vertices.front());
    if (!IsInside({x.dot(p), y.dot(p)}, points, ring)) continue;
    if (found < 0 || other.area_m2 < loops[static_cast<size_t>(found)].area_m2) found = static_cast<int>(i);
  }
  return found;
}

}  // namespace legopt

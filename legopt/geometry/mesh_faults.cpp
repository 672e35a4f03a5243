#include "legopt/geometry/mesh_faults.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <utility>

#include "legopt/geometry/mesh_components.h"

namespace legopt {
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
  std::map<std::pair<int, int>, int> balance;  // number of uses from the smaller to the larger vertex index, minus the
                                               // opposite ones
  for (const auto& triangle : mesh.triangles) {
    for (size_t k = 0; k < 3; ++k) {
      const int a = triangle[k];
      const int b = triangle[(k + 1) % 3];
      balance[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
    }
  }
  EdgeCount count{.all = static_cast<int>(balance.size()), .open = 0};
  for (const auto& [edge, sum] : balance) count.open += sum != 0 ? 1 : 0;
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

}  // namespace legopt

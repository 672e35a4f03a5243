#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "legopt/geometry/internal/mesh_repair.h"

namespace legopt {

/// A mesh under repair.
struct MarkedMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<int, 3>> triangles;
  std::vector<TriangleOrigin> origins;  ///< parallel to `triangles`
  std::vector<bool> turned;             ///< parallel to `triangles`; true if wound the other way than in the file

  const Eigen::Vector3d& at(int vertex) const { return vertices[static_cast<size_t>(vertex)]; }  ///< position, m
  /// Appends a triangle.
  void Add(const std::array<int, 3>& triangle, TriangleOrigin origin) {
    triangles.push_back(triangle);
    origins.push_back(origin);
    turned.push_back(false);
  }
  /// Turns a triangle round.
  void Turn(int t) {
    const auto i = static_cast<size_t>(t);
    std::swap(triangles[i][1], triangles[i][2]);
    turned[i] = !turned[i];
  }
  /// Returns the normal of a triangle with twice its area as length.
  Eigen::Vector3d Cross(const std::array<int, 3>& t) const { return (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])); }
};

/// One use of an edge by a triangle.
struct MarkedEdge {
  std::uint64_t key = 0;  ///< both vertices, the smaller one in the high half
  int triangle = 0;
  int corner = 0;        ///< the edge runs from this corner to the next
  bool forward = false;  ///< runs from the smaller to the larger vertex
};

/// Returns all edges of the listed triangles, uses of an edge side by side, in the order of the triangles.
std::vector<MarkedEdge> EdgesOf(const MarkedMesh& mesh, const std::vector<int>& triangles);

/// Calls visit(uses) with the span of uses of each distinct edge. `edges`: from EdgesOf.
template <class Visitor>
void ForEachEdge(const std::vector<MarkedEdge>& edges, Visitor visit) {
  for (size_t begin = 0; begin < edges.size();) {
    size_t end = begin + 1;
    while (end < edges.size() && edges[end].key == edges[begin].key) ++end;
    visit(std::span<const MarkedEdge>(edges).subspan(begin, end - begin));
    begin = end;
  }
}

/// Removes the triangles for which `drop` is set.
void RemoveTriangles(const std::vector<bool>& drop, MarkedMesh* mesh);

/// Groups triangles into components (mesh_bodies.h); each group lists triangles in ascending order.
std::vector<std::vector<int>> GroupComponents(const MarkedMesh& mesh, const std::vector<int>& triangles);

/// Groups triangles into patches connected by edges that exactly two of them use.
std::vector<std::vector<int>> GroupPatches(const MarkedMesh& mesh, const std::vector<int>& triangles);

/// Returns six times the volume enclosed by closed triangles, m^3; negative if they are inverted.
double SixVolumesOf(const MarkedMesh& mesh, const std::vector<int>& triangles);

/// Returns true if all edges of the triangles pair up in opposite directions.
bool IsClosedGroup(const MarkedMesh& mesh, const std::vector<int>& triangles);

/// Returns true for a closed group whose mean thickness is below the tolerance.
bool IsFlat(const MarkedMesh& mesh, const std::vector<int>& triangles, double tolerance_m);

/// Closed and open parts of a mesh.
struct OrientedParts {
  std::vector<std::vector<int>> solids;  ///< closed groups of triangles
  std::vector<std::vector<int>> sheets;  ///< other patches with consistent winding
};

/// Makes the winding of neighbours equal and separates closed parts from open ones. In open and flat parts, also
/// removes duplicates with opposite winding, and walls between two bodies, which then are one. Groups index the changed
/// mesh.
OrientedParts OrientTriangles(double tolerance_m, MarkedMesh* mesh, MeshRepairCounts* counts);

/// Turns closed groups outwards, and cavities inwards.
void TurnSolidsOutwards(const std::vector<std::vector<int>>& solids, MarkedMesh* mesh, MeshRepairCounts* counts);

/// Splits triangles at vertices that lie on their open edges.
void StitchJunctions(double tolerance_m, MarkedMesh* mesh, MeshRepairCounts* counts);

/// Closes patches with consistent winding: caps their holes or thickens them. Appends triangles and returns the closed
/// groups, without the patches that cannot be closed.
std::vector<std::vector<int>> ClosePatches(const std::vector<std::vector<int>>& patches,
                                           const MeshRepairOptions& options, MarkedMesh* mesh,
                                           MeshRepairCounts* counts);

}  // namespace legopt

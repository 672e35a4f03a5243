// Steps of a repair that treat triangles one by one: welding, duplicates, T-junctions.

#include "legopt/geometry/internal/mesh_repair.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <span>
#include <unordered_map>
#include <utility>

#include "legopt/geometry/internal/marked_mesh.h"
#include "legopt/geometry/internal/triangle_bvh.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"

namespace legopt {
namespace {

using Eigen::Vector3d;

/// Cell of a grid whose edges are as long as the welding tolerance.
struct GridCell {
  std::array<std::int64_t, 3> index{};
  bool operator==(const GridCell&) const = default;
};

struct GridCellHash {
  std::size_t operator()(const GridCell& cell) const {
    std::uint64_t hash = 0x9E3779B97F4A7C15ULL;
    for (const std::int64_t i : cell.index) {
      hash = (hash ^ static_cast<std::uint64_t>(i)) * 0xFF51AFD7ED558CCDULL;
      hash ^= hash >> 32;
    }
    return hash;
  }
};

/// Maps each vertex to the first earlier one within the tolerance that is not itself mapped.
class VertexWelder {
 public:
  explicit VertexWelder(double tolerance_m) : tolerance_m_(tolerance_m) {}

  int Weld(const Vector3d& point) {
    const GridCell cell = CellOf(point);
    GridCell near;
    for (int k = 0; k < 27; ++k) {
      near.index = {cell.index[0] + k % 3 - 1, cell.index[1] + k / 3 % 3 - 1, cell.index[2] + k / 9 - 1};
      const auto found = cells_.find(near);
      if (found == cells_.end()) continue;
      for (const int other : found->second) {
        if ((vertices_[static_cast<size_t>(other)] - point).norm() <= tolerance_m_) return other;
      }
    }
    const int index = static_cast<int>(vertices_.size());
    vertices_.push_back(point);
    cells_[cell].push_back(index);
    return index;
  }

  std::vector<Vector3d> Take() { return std::move(vertices_); }

 private:
  GridCell CellOf(const Vector3d& point) const {
    // The cell must not be smaller than the spacing of doubles at the point, or its index would overflow.
    constexpr double kMinCell_m = 1e-9;
    const double cell_m = std::max(tolerance_m_, kMinCell_m);
    constexpr double kLimit = 9e15;
    GridCell cell;
    for (int axis = 0; axis < 3; ++axis) {
      cell.index[static_cast<size_t>(axis)] =
          static_cast<std::int64_t>(std::clamp(std::floor(point[axis] / cell_m), -kLimit, kLimit));
    }
    return cell;
  }

  double tolerance_m_;
  std::vector<Vector3d> vertices_;
  std::unordered_map<GridCell, std::vector<int>, GridCellHash> cells_;
};

bool RepeatsCorner(const std::array<int, 3>& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }

MarkedMesh WeldVertices(const TriangleMesh& source, double tolerance_m, MeshRepairCounts* counts) {
  VertexWelder welder(tolerance_m);
  std::set<std::array<float, 3>> distinct;  // an equal vertex is not counted: readers weld these already
  std::vector<int> index;
  for (const Vector3d& vertex : source.vertices) {
    const Eigen::Vector3f rounded = vertex.cast<float>();
    distinct.insert({rounded.x() + 0.0F, rounded.y() + 0.0F, rounded.z() + 0.0F});
    index.push_back(welder.Weld(rounded.cast<double>()));
  }
  MarkedMesh mesh;
  mesh.vertices = welder.Take();
  counts->welded_vertices = static_cast<int>(distinct.size() - mesh.vertices.size());
  counts->degenerate_triangles = source.degenerate_triangles;
  for (std::array<int, 3> triangle : source.triangles) {
    for (int& corner : triangle) corner = index[static_cast<size_t>(corner)];
    if (RepeatsCorner(triangle)) {
      ++counts->degenerate_triangles;
    } else {
      mesh.Add(triangle, TriangleOrigin::kKept);
    }
  }
  return mesh;
}

/// Returns the triangle's corners, beginning with the smallest index.
std::array<int, 3> Rotated(std::array<int, 3> t) {
  std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return t;
}

void RemoveDuplicates(MarkedMesh* mesh, MeshRepairCounts* counts) {
  std::set<std::array<int, 3>> known;
  std::vector<bool> drop(mesh->triangles.size());
  for (size_t t = 0; t < drop.size(); ++t) {
    drop[t] = !known.insert(Rotated(mesh->triangles[t])).second;
    counts->duplicate_triangles += drop[t] ? 1 : 0;
  }
  RemoveTriangles(drop, mesh);
}

double HeightOf(const MarkedMesh& mesh, const std::array<int, 3>& t) {
  double longest = 0.0;
  for (size_t k = 0; k < 3; ++k) longest = std::max(longest, (mesh.at(t[(k + 1) % 3]) - mesh.at(t[k])).norm());
  return longest > 0.0 ? mesh.Cross(t).norm() / longest : 0.0;
}

/// Number of uses of each edge from the smaller to the larger vertex, minus the opposite ones.
using EdgeBalance = std::map<std::pair<int, int>, int>;

void AddToBalance(const std::array<int, 3>& t, int sign, EdgeBalance* balance) {
  for (size_t k = 0; k < 3; ++k) {
    const int a = t[k], b = t[(k + 1) % 3];
    (*balance)[{std::min(a, b), std::max(a, b)}] += a < b ? sign : -sign;
  }
}

int OpenEdgesAt(const std::array<int, 3>& t, const EdgeBalance& balance) {
  int open = 0;
  for (size_t k = 0; k < 3; ++k) {
    const int a = t[k], b = t[(k + 1) % 3];
    open += balance.at({std::min(a, b), std::max(a, b)}) != 0 ? 1 : 0;
  }
  return open;
}

/// Removes triangles without area. With `keep_needed`, only those whose removal does not open more edges.
void RemoveDegenerates(double tolerance_m, bool keep_needed, MarkedMesh* mesh, MeshRepairCounts* counts) {
  std::vector<size_t> flat;
  std::vector<bool> drop(mesh->triangles.size());
  for (size_t t = 0; t < drop.size(); ++t) {
    if (HeightOf(*mesh, mesh->triangles[t]) <= tolerance_m) flat.push_back(t);
  }
  if (flat.empty()) return;
  EdgeBalance balance;
  for (const auto& triangle : mesh->triangles) AddToBalance(triangle, 1, &balance);
  for (bool removed = true; removed;) {
    removed = false;
    for (const size_t t : flat) {
      if (drop[t]) continue;
      const std::array<int, 3>& triangle = mesh->triangles[t];
      const int before = OpenEdgesAt(triangle, balance);
      AddToBalance(triangle, -1, &balance);
      if (!keep_needed || OpenEdgesAt(triangle, balance) < before) {
        drop[t] = removed = true;
        ++counts->degenerate_triangles;
      } else {
        AddToBalance(triangle, 1, &balance);
      }
    }
  }
  RemoveTriangles(drop, mesh);
}

/// Splits triangles at vertices on their open edges, one edge of a triangle at a time.
class JunctionSplitter {
 public:
  JunctionSplitter(double tolerance_m, MarkedMesh* mesh) : tolerance_m_(tolerance_m), mesh_(*mesh) {}

  /// Makes one pass; returns the number of triangles that were split.
  int Pass() {
    FindOpenEdges();
    if (open_.empty()) return 0;
    TriangleMesh points{mesh_.vertices, {}};  // one triangle without extent for each end of an open edge
    for (const int v : ends_) points.triangles.push_back({v, v, v});
    const TriangleBvh tree(points);
    const std::vector<int> ends(ends_.begin(), ends_.end());
    std::vector<bool> split(mesh_.triangles.size());
    int count = 0;
    for (const MarkedEdge& edge : open_) {
      const auto t = static_cast<size_t>(edge.triangle);
      if (split[t]) continue;
      const std::vector<int> on_edge = VerticesOn(edge, tree, ends);
      if (on_edge.empty()) continue;
      split[t] = true;
      Split(edge, on_edge);
      ++count;
    }
    split.resize(mesh_.triangles.size());
    RemoveTriangles(split, &mesh_);
    return count;
  }

 private:
  void FindOpenEdges() {
    open_.clear();
    ends_.clear();
    std::vector<int> all(mesh_.triangles.size());
    std::iota(all.begin(), all.end(), 0);
    ForEachEdge(EdgesOf(mesh_, all), [&](std::span<const MarkedEdge> uses) {
      if (uses.size() % 2 == 0) return;
      for (const MarkedEdge& use : uses) {
        open_.push_back(use);
        const auto& triangle = mesh_.triangles[static_cast<size_t>(use.triangle)];
        ends_.insert(triangle[static_cast<size_t>(use.corner)]);
        ends_.insert(triangle[static_cast<size_t>((use.corner + 1) % 3)]);
      }
    });
  }

  /// Returns the vertices strictly inside the edge, in its direction.
  std::vector<int> VerticesOn(const MarkedEdge& edge, const TriangleBvh& tree, const std::vector<int>& ends) const {
    const auto& triangle = mesh_.triangles[static_cast<size_t>(edge.triangle)];
    const int from = triangle[static_cast<size_t>(edge.corner)],
              to = triangle[static_cast<size_t>((edge.corner + 1) % 3)];
    const int apex = triangle[static_cast<size_t>((edge.corner + 2) % 3)];
    const Vector3d& a = mesh_.at(from);
    const Vector3d along = mesh_.at(to) - a;
    const double length = along.norm();
    if (!(length > 0.0)) return {};
    Eigen::AlignedBox3d box(a.cwiseMin(mesh_.at(to)).array() - tolerance_m_,
                            a.cwiseMax(mesh_.at(to)).array() + tolerance_m_);
    std::vector<std::pair<double, int>> found;
    tree.AnyOverlapping(box, [&](int index) {
      const int v = ends[static_cast<size_t>(index)];
      const Vector3d d = mesh_.at(v) - a;
      const double position = d.dot(along) / length;
      if (v != from && v != to && v != apex && position > 0.0 && position < length &&
          (d - along * (position / length)).norm() <= tolerance_m_) {
        found.emplace_back(position, v);
      }
      return false;
    });
    std::sort(found.begin(), found.end());
    std::vector<int> vertices;
    for (const auto& [position, v] : found) vertices.push_back(v);
    return vertices;
  }

  void Split(const MarkedEdge& edge, const std::vector<int>& on_edge) {
    const std::array<int, 3> triangle = mesh_.triangles[static_cast<size_t>(edge.triangle)];
    const int apex = triangle[static_cast<size_t>((edge.corner + 2) % 3)];
    int last = triangle[static_cast<size_t>(edge.corner)];
    std::vector<int> stops = on_edge;
    stops.push_back(triangle[static_cast<size_t>((edge.corner + 1) % 3)]);
    for (const int next : stops) {
      mesh_.Add({last, next, apex}, TriangleOrigin::kChanged);
      last = next;
    }
  }

  double tolerance_m_;
  MarkedMesh& mesh_;
  std::vector<MarkedEdge> open_;
  std::set<int> ends_;
};

/// Turns patches with few open edges outwards, which FindMeshFaults counts as inverted bodies.
void TurnNearlyClosed(const std::vector<std::vector<int>>& patches, MarkedMesh* mesh, MeshRepairCounts* counts) {
  for (const std::vector<int>& patch : patches) {
    TriangleMesh part{mesh->vertices, {}};
    for (const int t : patch) part.triangles.push_back(mesh->triangles[static_cast<size_t>(t)]);
    if (FindMeshFaults(part).inverted_components == 0) continue;
    ++counts->turned_bodies;
    for (const int t : patch) mesh->Turn(t);
  }
}

/// Drops vertices that no triangle uses and keeps the order of the rest.
TriangleMesh Compact(MarkedMesh mesh) {
  TriangleMesh compact;
  std::vector<int> index(mesh.vertices.size(), -1);
  for (const auto& triangle : mesh.triangles) {
    for (const int corner : triangle) index[static_cast<size_t>(corner)] = 0;
  }
  for (size_t v = 0; v < index.size(); ++v) {
    if (index[v] < 0) continue;
    index[v] = static_cast<int>(compact.vertices.size());
    compact.vertices.push_back(mesh.vertices[v]);
  }
  compact.triangles = std::move(mesh.triangles);
  for (auto& triangle : compact.triangles) {
    for (int& corner : triangle) corner = index[static_cast<size_t>(corner)];
  }
  return compact;
}

}  // namespace

void StitchJunctions(double tolerance_m, MarkedMesh* mesh, MeshRepairCounts* counts) {
  constexpr int kMaxPasses = 64;  // a pass splits one edge of a triangle
  JunctionSplitter splitter(tolerance_m, mesh);
  for (int pass = 0; pass < kMaxPasses; ++pass) {
    const int split = splitter.Pass();
    if (split == 0) return;
    counts->split_triangles += split;
  }
}

bool MeshRepairCounts::none() const { return *this == MeshRepairCounts(); }

void MeshRepairCounts::Add(const MeshRepairCounts& other) {
  for (const MeshRepairEntry& entry : MeshRepairEntries()) this->*entry.count += other.*entry.count;
}

const std::vector<MeshRepairEntry>& MeshRepairEntries() {
  using Counts = MeshRepairCounts;
  static const std::vector<MeshRepairEntry> kEntries = {
      {"welded_vertices", "vertices welded", &Counts::welded_vertices},
      {"degenerate_triangles", "triangles without area removed", &Counts::degenerate_triangles},
      {"duplicate_triangles", "duplicate triangles removed", &Counts::duplicate_triangles},
      {"inner_triangles", "triangles inside of bodies removed", &Counts::inner_triangles},
      {"turned_triangles", "triangles turned round", &Counts::turned_triangles},
      {"turned_bodies", "bodies turned outwards", &Counts::turned_bodies},
      {"split_triangles", "triangles split at T-junctions", &Counts::split_triangles},
      {"capped_holes", "holes capped", &Counts::capped_holes},
      {"uneven_holes", "of these holes not planar", &Counts::uneven_holes},
      {"thickened_ground", "ground sheets thickened", &Counts::thickened_ground},
      {"thickened_walls", "wall sheets thickened", &Counts::thickened_walls},
      {"cavities", "cavities kept", &Counts::cavities},
      {"added_triangles", "triangles added", &Counts::added_triangles}};
  return kEntries;
}

std::string ToString(const MeshRepairCounts& counts) {
  std::string text;
  for (const MeshRepairEntry& entry : MeshRepairEntries()) {
    const int count = counts.*entry.count;
    if (count == 0) continue;
    text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + entry.description;
  }
  return text.empty() ? "nothing to repair" : text;
}

void MeshRepairOptions::Validate() const {
  const auto check = [](const char* flag, double value_m, bool zero_is_valid, const char* fix) {
    if (std::isfinite(value_m) && (value_m > 0.0 || (zero_is_valid && value_m == 0.0)) && value_m <= 1.0) return;
    throw InputError({"", flag, FormatGeneral(value_m, 6),
                      zero_is_valid ? "must be from 0 to 1 m" : "must be greater than 0 and at most 1 m", fix});
  };
  check("--weld", weld_m, true, "e.g. --weld 1e-5, the default");
  check("--thickness", ground_thickness_m, false, "e.g. --thickness 0.1");
  check("--thickness", wall_thickness_m, false, "e.g. --thickness 0.1");
}

double EnclosedVolume(const TriangleMesh& mesh) {
  double sum = 0.0;
  for (const TriangleMesh& component : SplitIntoComponents(mesh)) {
    if (!IsClosed(component)) continue;
    const Vector3d& origin = component.vertices.front();
    const auto at = [&](int v) -> Vector3d { return component.vertices[static_cast<size_t>(v)] - origin; };
    for (const auto& [a, b, c] : component.triangles) sum += at(a).dot(at(b).cross(at(c)));
  }
  constexpr double kSixth = 1.0 / 6.0;  // a tetrahedron is a sixth of its box
  return kSixth * sum;
}

int CountDuplicates(const TriangleMesh& mesh) {
  std::vector<std::array<int, 3>> sorted;
  sorted.reserve(mesh.triangles.size());
  for (const auto& triangle : mesh.triangles) sorted.push_back(Rotated(triangle));
  std::sort(sorted.begin(), sorted.end());
  return static_cast<int>(sorted.end() - std::unique(sorted.begin(), sorted.end()));
}

int CountFlatBodies(const TriangleMesh& mesh) {
  const MarkedMesh marked{mesh.vertices, mesh.triangles, {}, {}};
  const auto groups = GroupTrianglesByComponent(mesh);
  return static_cast<int>(std::count_if(groups.begin(), groups.end(), [&](const std::vector<int>& group) {
    return IsClosedGroup(marked, group) && IsFlat(marked, group, MeshRepairOptions().weld_m);
  }));
}

RepairedMesh RepairMesh(const TriangleMesh& source, const MeshRepairOptions& options) {
  options.Validate();
  RepairedMesh result;
  MarkedMesh mesh = WeldVertices(source, options.weld_m, &result.counts);
  RemoveDuplicates(&mesh, &result.counts);
  constexpr double kNoHeight_m = 1e-9;
  RemoveDegenerates(options.close ? std::max(options.weld_m, kNoHeight_m) : kNoHeight_m, !options.close, &mesh,
                    &result.counts);
  if (options.close) {
    StitchJunctions(std::max(options.weld_m, kNoHeight_m), &mesh, &result.counts);
    RemoveDuplicates(&mesh, &result.counts);
  }
  OrientedParts parts = OrientTriangles(options.weld_m, &mesh, &result.counts);
  if (options.close) {
    for (auto& solid : ClosePatches(parts.sheets, options, &mesh, &result.counts)) {
      parts.solids.push_back(std::move(solid));
    }
  }
  TurnSolidsOutwards(parts.solids, &mesh, &result.counts);
  if (!options.close) TurnNearlyClosed(parts.sheets, &mesh, &result.counts);
  RemoveDuplicates(&mesh, &result.counts);  // a body with two faces is two bodies until here
  for (size_t t = 0; t < mesh.turned.size(); ++t) {
    if (!mesh.turned[t] || mesh.origins[t] == TriangleOrigin::kAdded) continue;
    mesh.origins[t] = TriangleOrigin::kChanged;
    ++result.counts.turned_triangles;
  }
  result.origins = mesh.origins;
  result.counts.added_triangles =
      static_cast<int>(std::count(mesh.origins.begin(), mesh.origins.end(), TriangleOrigin::kAdded));
  result.mesh = Compact(std::move(mesh));
  result.faults = FindMeshFaults(result.mesh);
  result.volume_m3 = EnclosedVolume(result.mesh);
  return result;
}

}  // namespace legopt

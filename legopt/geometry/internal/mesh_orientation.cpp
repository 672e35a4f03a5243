// Winding of a mesh under repair: neighbours alike, bodies outwards, cavities inwards.

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numeric>
#include <set>
#include <span>
#include <vector>

#include "legopt/geometry/internal/marked_mesh.h"
#include "legopt/geometry/internal/triangle_bvh.h"

namespace legopt {
namespace {

using Eigen::Vector3d;

std::vector<int> AllTriangles(const MarkedMesh& mesh) {
  std::vector<int> all(mesh.triangles.size());
  std::iota(all.begin(), all.end(), 0);
  return all;
}

TriangleMesh PartOf(const MarkedMesh& mesh, const std::vector<int>& triangles) {
  TriangleMesh part;
  std::map<int, int> index;
  for (const int t : triangles) {
    std::array<int, 3> corners = mesh.triangles[static_cast<size_t>(t)];
    for (int& corner : corners) {
      const auto [it, fresh] = index.try_emplace(corner, static_cast<int>(part.vertices.size()));
      if (fresh) part.vertices.push_back(mesh.at(corner));
      corner = it->second;
    }
    part.triangles.push_back(corners);
  }
  return part;
}

double AreaOf(const MarkedMesh& mesh, const std::vector<int>& triangles) {
  double twice = 0.0;
  for (const int t : triangles) twice += mesh.Cross(mesh.triangles[static_cast<size_t>(t)]).norm();
  return 0.5 * twice;
}

/// Patches of triangles with the turns that make the winding of neighbours equal.
class WindingFlood {
 public:
  WindingFlood(MarkedMesh* mesh, const std::vector<int>& triangles) : mesh_(*mesh), triangles_(triangles) {}

  /// Turns triangles of each patch, as little area as possible.
  void Run() {
    std::vector<std::vector<std::pair<int, bool>>> neighbours(mesh_.triangles.size());  // bool: wound the other way
    ForEachEdge(EdgesOf(mesh_, triangles_), [&](std::span<const MarkedEdge> uses) {
      if (uses.size() != 2 || uses[0].triangle == uses[1].triangle) return;
      const bool differs = uses[0].forward == uses[1].forward;
      neighbours[static_cast<size_t>(uses[0].triangle)].emplace_back(uses[1].triangle, differs);
      neighbours[static_cast<size_t>(uses[1].triangle)].emplace_back(uses[0].triangle, differs);
    });
    enum : char { kUnseen, kAsIs, kOther };
    std::vector<char> state(mesh_.triangles.size(), kUnseen);
    for (const int seed : triangles_) {
      if (state[static_cast<size_t>(seed)] != kUnseen) continue;
      std::vector<int> patch = {seed};
      state[static_cast<size_t>(seed)] = kAsIs;
      for (size_t next = 0; next < patch.size(); ++next) {
        const char own = state[static_cast<size_t>(patch[next])];
        for (const auto& [other, differs] : neighbours[static_cast<size_t>(patch[next])]) {
          char& theirs = state[static_cast<size_t>(other)];
          if (theirs != kUnseen) continue;
          theirs = (own == kAsIs) == differs ? kOther : kAsIs;
          patch.push_back(other);
        }
      }
      std::vector<int> turned, kept;
      for (const int t : patch) (state[static_cast<size_t>(t)] == kOther ? turned : kept).push_back(t);
      const bool fewer = AreaOf(mesh_, turned) <= AreaOf(mesh_, kept);
      for (const int t : fewer ? turned : kept) mesh_.Turn(t);
    }
  }

 private:
  MarkedMesh& mesh_;
  const std::vector<int>& triangles_;
};

/// Turns whole patches while that opens fewer edges: patches that meet at edges of more than two triangles.
void TurnPatches(const std::vector<std::vector<int>>& patches, const std::vector<int>& triangles, MarkedMesh* mesh) {
  std::vector<int> patch_of(mesh->triangles.size(), -1);
  for (size_t p = 0; p < patches.size(); ++p) {
    for (const int t : patches[p]) patch_of[static_cast<size_t>(t)] = static_cast<int>(p);
  }
  struct Shared {
    std::map<int, int> balance;  // uses in forward direction minus others, per patch
  };
  std::vector<Shared> shared;
  std::vector<std::vector<size_t>> edges_of(patches.size());
  ForEachEdge(EdgesOf(*mesh, triangles), [&](std::span<const MarkedEdge> uses) {
    Shared edge;
    for (const MarkedEdge& use : uses) {
      edge.balance[patch_of[static_cast<size_t>(use.triangle)]] += use.forward ? 1 : -1;
    }
    if (edge.balance.size() < 2) return;
    for (const auto& [patch, sum] : edge.balance) edges_of[static_cast<size_t>(patch)].push_back(shared.size());
    shared.push_back(std::move(edge));
  });
  const auto open = [&](size_t patch) {
    int count = 0;
    for (const size_t e : edges_of[patch]) {
      int sum = 0;
      for (const auto& [other, own] : shared[e].balance) sum += own;
      count += std::abs(sum);
    }
    return count;
  };
  const auto flip = [&](size_t patch) {
    for (const size_t e : edges_of[patch]) {
      int& own = shared[e].balance.at(static_cast<int>(patch));
      own = -own;
    }
  };
  constexpr int kMaxPasses = 32;
  bool changed = true;
  for (int pass = 0; changed && pass < kMaxPasses; ++pass) {
    changed = false;
    for (size_t p = 0; p < patches.size(); ++p) {
      if (edges_of[p].empty()) continue;
      const int before = open(p);
      flip(p);
      if (open(p) < before) {
        for (const int t : patches[p]) mesh->Turn(t);
        changed = true;
      } else {
        flip(p);
      }
    }
  }
}

/// Marks triangles with the corners of an earlier one, whatever their winding.
std::vector<bool> FindTwins(const MarkedMesh& mesh, const std::vector<int>& triangles) {
  std::set<std::array<int, 3>> known;
  std::vector<bool> drop(mesh.triangles.size());
  for (const int t : triangles) {
    std::array<int, 3> corners = mesh.triangles[static_cast<size_t>(t)];
    std::sort(corners.begin(), corners.end());
    drop[static_cast<size_t>(t)] = !known.insert(corners).second;
  }
  return drop;
}

/// Marks walls inside of a body: patches with two other faces along their whole outline. Of the three patches that meet
/// at such an outline, the smallest is the wall, since both others enclose a volume with it.
std::vector<bool> FindInnerWalls(const MarkedMesh& mesh, const std::vector<int>& triangles) {
  std::vector<bool> drop(mesh.triangles.size());
  std::map<std::uint64_t, size_t> uses_of;
  ForEachEdge(EdgesOf(mesh, triangles), [&](std::span<const MarkedEdge> uses) {
    if (uses.size() > 2) uses_of[uses.front().key] = uses.size();
  });
  if (uses_of.empty()) return drop;
  std::vector<std::vector<int>> patches = GroupPatches(mesh, triangles);
  std::stable_sort(patches.begin(), patches.end(),
                   [&](const auto& a, const auto& b) { return AreaOf(mesh, a) < AreaOf(mesh, b); });
  for (const std::vector<int>& patch : patches) {
    bool wall = true;
    std::vector<std::uint64_t> outline;
    ForEachEdge(EdgesOf(mesh, patch), [&](std::span<const MarkedEdge> uses) {
      if (uses.size() == 2) return;
      const auto found = uses_of.find(uses.front().key);
      wall = wall && uses.size() == 1 && found != uses_of.end() && found->second == 3;
      outline.push_back(uses.front().key);
    });
    if (!wall || outline.empty()) continue;
    for (const std::uint64_t key : outline) --uses_of.at(key);
    for (const int t : patch) drop[static_cast<size_t>(t)] = true;
  }
  return drop;
}

/// Closed groups whose winding is right already, and the triangles of all others.
struct Sorted {
  std::vector<std::vector<int>> solids;
  std::vector<int> rest;
};

Sorted SortComponents(double tolerance_m, const MarkedMesh& mesh, const std::vector<int>& triangles) {
  Sorted sorted;
  for (std::vector<int>& group : GroupComponents(mesh, triangles)) {
    if (IsClosedGroup(mesh, group) && !IsFlat(mesh, group, tolerance_m)) {
      sorted.solids.push_back(std::move(group));
    } else {
      sorted.rest.insert(sorted.rest.end(), group.begin(), group.end());
    }
  }
  std::sort(sorted.rest.begin(), sorted.rest.end());
  return sorted;
}

}  // namespace

std::vector<MarkedEdge> EdgesOf(const MarkedMesh& mesh, const std::vector<int>& triangles) {
  std::vector<MarkedEdge> edges;
  edges.reserve(3 * triangles.size());
  for (const int t : triangles) {
    const auto& corners = mesh.triangles[static_cast<size_t>(t)];
    for (int k = 0; k < 3; ++k) {
      const auto a = static_cast<std::uint64_t>(corners[static_cast<size_t>(k)]);
      const auto b = static_cast<std::uint64_t>(corners[static_cast<size_t>((k + 1) % 3)]);
      edges.push_back({(std::min(a, b) << 32) | std::max(a, b), t, k, a < b});
    }
  }
  std::stable_sort(edges.begin(), edges.end(), [](const auto& a, const auto& b) { return a.key < b.key; });
  return edges;
}

void RemoveTriangles(const std::vector<bool>& drop, MarkedMesh* mesh) {
  MarkedMesh kept;
  for (size_t t = 0; t < mesh->triangles.size(); ++t) {
    if (drop[t]) continue;
    kept.Add(mesh->triangles[t], mesh->origins[t]);
    kept.turned.back() = mesh->turned[t];
  }
  kept.vertices = std::move(mesh->vertices);
  *mesh = std::move(kept);
}

std::vector<std::vector<int>> GroupComponents(const MarkedMesh& mesh, const std::vector<int>& triangles) {
  std::vector<std::vector<int>> groups = GroupTrianglesByComponent(PartOf(mesh, triangles));
  for (std::vector<int>& group : groups) {
    for (int& t : group) t = triangles[static_cast<size_t>(t)];
  }
  return groups;
}

std::vector<std::vector<int>> GroupPatches(const MarkedMesh& mesh, const std::vector<int>& triangles) {
  std::vector<std::vector<int>> neighbours(mesh.triangles.size());
  ForEachEdge(EdgesOf(mesh, triangles), [&](std::span<const MarkedEdge> uses) {
    if (uses.size() != 2) return;
    neighbours[static_cast<size_t>(uses[0].triangle)].push_back(uses[1].triangle);
    neighbours[static_cast<size_t>(uses[1].triangle)].push_back(uses[0].triangle);
  });
  std::vector<bool> seen(mesh.triangles.size());
  std::vector<std::vector<int>> patches;
  for (const int seed : triangles) {
    if (seen[static_cast<size_t>(seed)]) continue;
    seen[static_cast<size_t>(seed)] = true;
    std::vector<int> patch = {seed};
    for (size_t next = 0; next < patch.size(); ++next) {
      for (const int other : neighbours[static_cast<size_t>(patch[next])]) {
        if (seen[static_cast<size_t>(other)]) continue;
        seen[static_cast<size_t>(other)] = true;
        patch.push_back(other);
      }
    }
    std::sort(patch.begin(), patch.end());
    patches.push_back(std::move(patch));
  }
  return patches;
}

double SixVolumesOf(const MarkedMesh& mesh, const std::vector<int>& triangles) {
  if (triangles.empty()) return 0.0;
  const Vector3d origin = mesh.at(mesh.triangles[static_cast<size_t>(triangles.front())][0]);
  double sum = 0.0;
  for (const int t : triangles) {
    const auto& [a, b, c] = mesh.triangles[static_cast<size_t>(t)];
    sum += (mesh.at(a) - origin).dot((mesh.at(b) - origin).cross(mesh.at(c) - origin));
  }
  return sum;
}

bool IsClosedGroup(const MarkedMesh& mesh, const std::vector<int>& triangles) {
  bool closed = !triangles.empty();
  ForEachEdge(EdgesOf(mesh, triangles), [&](std::span<const MarkedEdge> uses) {
    int balance = 0;
    for (const MarkedEdge& use : uses) balance += use.forward ? 1 : -1;
    closed = closed && balance == 0;
  });
  return closed;
}

bool IsFlat(const MarkedMesh& mesh, const std::vector<int>& triangles, double tolerance_m) {
  constexpr double kMinThickness_m = 1e-9;
  const double volume = std::abs(SixVolumesOf(mesh, triangles)) / 6.0;
  return volume <= 0.5 * AreaOf(mesh, triangles) * std::max(tolerance_m, kMinThickness_m);  // half: both faces count
}

OrientedParts OrientTriangles(double tolerance_m, MarkedMesh* mesh, MeshRepairCounts* counts) {
  Sorted sorted = SortComponents(tolerance_m, *mesh, AllTriangles(*mesh));
  const auto remove = [&](const std::vector<bool>& drop, int* count) {
    const auto removed = static_cast<int>(std::count(drop.begin(), drop.end(), true));
    if (removed == 0) return;
    *count += removed;
    RemoveTriangles(drop, mesh);
    sorted = SortComponents(tolerance_m, *mesh, AllTriangles(*mesh));
  };
  remove(FindTwins(*mesh, sorted.rest), &counts->duplicate_triangles);
  remove(FindInnerWalls(*mesh, sorted.rest), &counts->inner_triangles);
  WindingFlood(mesh, sorted.rest).Run();
  const std::vector<std::vector<int>> patches = GroupPatches(*mesh, sorted.rest);
  OrientedParts parts{.solids = std::move(sorted.solids), .sheets = {}};
  std::vector<int> open;
  std::vector<std::vector<int>> open_patches;
  for (const std::vector<int>& patch : patches) {
    if (IsClosedGroup(*mesh, patch)) {
      parts.solids.push_back(patch);
    } else {
      open.insert(open.end(), patch.begin(), patch.end());
      open_patches.push_back(patch);
    }
  }
  TurnPatches(open_patches, open, mesh);
  std::sort(open.begin(), open.end());
  sorted = SortComponents(tolerance_m, *mesh, open);
  for (std::vector<int>& solid : sorted.solids) parts.solids.push_back(std::move(solid));
  parts.sheets = GroupPatches(*mesh, sorted.rest);
  return parts;
}

namespace {

/// Returns for each solid the smallest other one around it, or -1.
class Nesting {
 public:
  Nesting(const MarkedMesh& mesh, const std::vector<std::vector<int>>& solids) : mesh_(mesh), solids_(solids) {
    for (const std::vector<int>& solid : solids) {
      Eigen::AlignedBox3d& box = boxes_.emplace_back();
      for (const int t : solid) {
        for (const int corner : mesh.triangles[static_cast<size_t>(t)]) box.extend(mesh.at(corner));
      }
    }
    bodies_.resize(solids.size());
  }

  std::vector<int> Parents() {
    TriangleMesh corners;  // one triangle per box, with its bounds
    for (const auto& box : boxes_) {
      const int first = static_cast<int>(corners.vertices.size());
      corners.vertices.push_back(box.min());
      corners.vertices.push_back(box.max());
      corners.triangles.push_back({first, first + 1, first});
    }
    const TriangleBvh tree(corners);
    std::vector<int> parents(solids_.size(), -1);
    for (size_t i = 0; i < solids_.size(); ++i) {
      double smallest = 0.0;
      tree.AnyOverlapping(boxes_[i], [&](int found) {
        const auto j = static_cast<size_t>(found);
        if (j == i || !boxes_[j].contains(boxes_[i])) return false;
        const double volume = std::abs(SixVolumesOf(mesh_, solids_[j]));
        if (volume <= std::abs(SixVolumesOf(mesh_, solids_[i])) || (parents[i] >= 0 && volume >= smallest))
          return false;
        if (!Encloses(j, i)) return false;
        parents[i] = found;
        smallest = volume;
        return false;
      });
    }
    return parents;
  }

 private:
  /// Returns true if some corner of the inner solid is inside the outer one and none that was tried is outside.
  bool Encloses(size_t outer, size_t inner) {
    constexpr size_t kTried = 16;
    constexpr double kInside_m = 1e-9;
    if (!bodies_[outer]) bodies_[outer] = std::make_unique<ClosedBodies>(PartOf(mesh_, solids_[outer]));
    const TriangleMesh part = PartOf(mesh_, solids_[inner]);
    const size_t step = std::max<size_t>(1, part.vertices.size() / kTried);
    bool any = false;
    for (size_t v = 0; v < part.vertices.size(); v += step) {
      if (bodies_[outer]->Depth(part.vertices[v]) <= kInside_m) return false;
      any = true;
    }
    return any;
  }

  const MarkedMesh& mesh_;
  const std::vector<std::vector<int>>& solids_;
  std::vector<Eigen::AlignedBox3d> boxes_;
  std::vector<std::unique_ptr<ClosedBodies>> bodies_;
};

}  // namespace

void TurnSolidsOutwards(const std::vector<std::vector<int>>& solids, MarkedMesh* mesh, MeshRepairCounts* counts) {
  std::vector<bool> inverted;
  for (const std::vector<int>& solid : solids) inverted.push_back(SixVolumesOf(*mesh, solid) < 0.0);
  const auto negative = std::count(inverted.begin(), inverted.end(), true);
  if (negative == 0) return;
  const bool mixed = negative < std::ssize(inverted);
  const std::vector<int> parents = mixed ? Nesting(*mesh, solids).Parents() : std::vector<int>(solids.size(), -1);
  for (size_t i = 0; i < solids.size(); ++i) {
    int changes = 0;  // changes of winding from the outermost body inwards
    for (int inner = static_cast<int>(i); parents[static_cast<size_t>(inner)] >= 0;) {
      const int outer = parents[static_cast<size_t>(inner)];
      changes += inverted[static_cast<size_t>(inner)] != inverted[static_cast<size_t>(outer)] ? 1 : 0;
      inner = outer;
    }
    const bool cavity = changes % 2 != 0;
    counts->cavities += cavity ? 1 : 0;
    if (inverted[i] == cavity) continue;
    ++counts->turned_bodies;
    for (const int t : solids[i]) mesh->Turn(t);
  }
}

}  // namespace legopt

// Closes open patches of a mesh under repair: caps of holes, thickness of sheets.

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <span>
#include <vector>

#include "legopt/geometry/internal/marked_mesh.h"
#include "legopt/geometry/internal/mesh_loops.h"
#include "legopt/geometry/internal/polygon_triangulation.h"

namespace legopt {
namespace {

using Eigen::Vector3d;

/// Joins patches whose holes all lie in holes of one other patch: the inner and the outer wall of a pipe.
std::vector<std::vector<int>> JoinNested(const MarkedMesh& mesh, const std::vector<std::vector<int>>& patches,
                                         double tolerance_m) {
  constexpr size_t kMaxLoops = 4000;  // the search is quadratic; scenes with more holes are not pipes
  std::vector<MeshLoop> loops;
  std::vector<size_t> patch_of;
  for (size_t p = 0; p < patches.size(); ++p) {
    for (std::vector<int>& loop : TraceLoops(RimOf(mesh, patches[p]))) {
      loops.push_back(MeasureLoop(mesh, std::move(loop)));
      patch_of.push_back(p);
    }
  }
  if (loops.size() > kMaxLoops) return patches;
  enum : int { kUnseen = -1, kNone = -2 };
  std::vector<int> outer(patches.size(), kUnseen);
  for (size_t i = 0; i < loops.size(); ++i) {
    const int around = SmallestAround(mesh, loops, i, tolerance_m);
    const int other = around < 0 ? kNone : static_cast<int>(patch_of[static_cast<size_t>(around)]);
    int& known = outer[patch_of[i]];
    known = (known == kUnseen || known == other) && other != static_cast<int>(patch_of[i]) ? other : kNone;
  }
  std::vector<std::vector<int>> joined = patches;
  for (size_t p = 0; p < patches.size(); ++p) {
    // A patch that is itself inside of another one stays alone: its outer patch is moved away.
    if (outer[p] < 0 || outer[static_cast<size_t>(outer[p])] >= 0) continue;
    std::vector<int>& target = joined[static_cast<size_t>(outer[p])];
    target.insert(target.end(), joined[p].begin(), joined[p].end());
    joined[p].clear();
  }
  std::erase_if(joined, [](const std::vector<int>& patch) { return patch.empty(); });
  return joined;
}

/// Extents, area and mean normal of a patch.
struct PatchShape {
  double diagonal_m = 0.0;
  double area_m2 = 0.0;
  Vector3d mean_normal = Vector3d::Zero();  ///< sum of area times normal over the area
  double steep_share = 0.0;                 ///< share of the area that is nearly vertical or overhangs
  bool planar = false;
};

PatchShape ShapeOf(const MarkedMesh& mesh, const std::vector<int>& patch, double tolerance_m) {
  PatchShape shape;
  Eigen::AlignedBox3d box;
  Vector3d sum = Vector3d::Zero();
  for (const int t : patch) {
    const auto& corners = mesh.triangles[static_cast<size_t>(t)];
    for (const int v : corners) box.extend(mesh.at(v));
    const Vector3d cross = mesh.Cross(corners);
    sum += 0.5 * cross;
    shape.area_m2 += 0.5 * cross.norm();
  }
  shape.diagonal_m = box.diagonal().norm();
  if (!(shape.area_m2 > 0.0)) return shape;
  shape.mean_normal = sum / shape.area_m2;
  const double up = sum.z() < 0.0 ? -1.0 : 1.0;
  constexpr double kSteep = 0.02;  // cosine; steps have risers, terrain has none
  double steep_m2 = 0.0;
  for (const int t : patch) {
    const Vector3d cross = mesh.Cross(mesh.triangles[static_cast<size_t>(t)]);
    if (up * cross.z() < kSteep * cross.norm()) steep_m2 += 0.5 * cross.norm();
  }
  shape.steep_share = steep_m2 / shape.area_m2;
  constexpr double kPlanar = 1e-4;  // largest height of a planar hole, in sizes
  const double tolerance = std::max(tolerance_m, kPlanar * shape.diagonal_m);
  const Vector3d& origin = mesh.at(mesh.triangles[static_cast<size_t>(patch.front())][0]);
  const Vector3d normal = sum.norm() > 0.0 ? Vector3d(sum.normalized()) : Vector3d(Vector3d::UnitZ());
  shape.planar = sum.norm() > 0.5 * shape.area_m2 && std::all_of(patch.begin(), patch.end(), [&](int t) {
                   const auto& corners = mesh.triangles[static_cast<size_t>(t)];
                   return std::all_of(corners.begin(), corners.end(),
                                      [&](int v) { return std::abs((mesh.at(v) - origin).dot(normal)) <= tolerance; });
                 });
  return shape;
}

class PatchCloser {
 public:
  PatchCloser(const std::vector<int>& patch, const MeshRepairOptions& options, MarkedMesh* mesh,
              MeshRepairCounts* counts)
      : patch_(patch),
        options_(options),
        mesh_(*mesh),
        counts_(*counts),
        shape_(ShapeOf(*mesh, patch, options.weld_m)),
        rim_(RimOf(*mesh, patch)) {
    for (const RimEdge& edge : rim_) triangle_of_[{edge.to, edge.from}] = edge.triangle;
  }

  /// Returns the triangles of the closed body, or nothing.
  std::vector<int> Close() {
    if (!(shape_.area_m2 > 0.0)) return {};
    for (std::vector<int>& loop : TraceLoops(rim_)) loops_.push_back(MeasureLoop(mesh_, std::move(loop)));
    const bool vessel = !shape_.planar && CanCap() && IsOpenVesselSeenFromInside();
    if (!shape_.planar && !vessel && CanCap()) {
      std::vector<int> capped = Cap();
      if (!capped.empty()) return capped;
    }
    return vessel ? ThickenOutwards() : Thicken();
  }

 private:
  /// Returns true if every hole is planar, or small and nearly planar, and no cap would lie on the patch itself.
  bool CanCap() const {
    if (loops_.empty()) return false;
    constexpr double kPlanar = 1e-4, kUneven = 0.1, kSmall = 0.5;
    for (const MeshLoop& loop : loops_) {
      const bool planar = loop.deviation_m <= std::max(options_.weld_m, kPlanar * loop.diagonal_m);
      const bool small = loop.deviation_m <= kUneven * loop.diagonal_m && loop.diagonal_m <= kSmall * shape_.diagonal_m;
      if (!planar && !small) return false;
      if (FoldsBack(loop)) return false;
    }
    return true;
  }

  /// Returns true if a cap would lie on the faces along most of its outline: the flat border of terrain.
  bool FoldsBack(const MeshLoop& loop) const {
    double all_m = 0.0, folded_m = 0.0;
    constexpr double kParallel = 0.999;
    for (size_t k = 0; k < loop.vertices.size(); ++k) {
      const int a = loop.vertices[k], b = loop.vertices[(k + 1) % loop.vertices.size()];
      const auto found = triangle_of_.find({a, b});
      if (found == triangle_of_.end()) continue;
      const double length = (mesh_.at(b) - mesh_.at(a)).norm();
      all_m += length;
      const Vector3d normal = mesh_.Cross(mesh_.triangles[static_cast<size_t>(found->second)]).normalized();
      if (normal.dot(loop.normal) < -kParallel) folded_m += length;
    }
    return folded_m > 0.5 * all_m;
  }

  /// Returns six times the volume under the capped patch; negative if its faces look inwards.
  double SixCappedVolumes() const {
    const Vector3d& origin = loops_.front().centre;
    double sum = 0.0;
    for (const int t : patch_) {
      const auto& [a, b, c] = mesh_.triangles[static_cast<size_t>(t)];
      sum += (mesh_.at(a) - origin).dot((mesh_.at(b) - origin).cross(mesh_.at(c) - origin));
    }
    for (const MeshLoop& loop : loops_) sum += 2.0 * loop.area_m2 * (loop.centre - origin).dot(loop.normal);
    return sum;
  }

  /// Returns true for a room without ceiling or a pit: faces as in the file look inwards, and the hole is on top.
  bool IsOpenVesselSeenFromInside() const {
    const bool as_in_file = std::none_of(
        patch_.begin(), patch_.end(), [&](int t) { return static_cast<bool>(mesh_.turned[static_cast<size_t>(t)]); });
    if (!as_in_file || !(SixCappedVolumes() < 0.0)) return false;
    double up_m2 = 0.0, all_m2 = 0.0;
    constexpr double kUp = 0.7;
    for (const MeshLoop& loop : loops_) {
      all_m2 += loop.area_m2;
      if (-loop.normal.z() > kUp) up_m2 += loop.area_m2;  // the cap's area, seen from outside
    }
    return up_m2 > 0.5 * all_m2;
  }

  /// Adds the caps. Returns all triangles of the closed body, or nothing if a cap fails; then adds nothing.
  std::vector<int> Cap() {
    std::vector<std::array<int, 3>> caps;
    std::vector<bool> done(loops_.size());
    std::vector<int> around;
    for (size_t i = 0; i < loops_.size(); ++i) around.push_back(SmallestAround(mesh_, loops_, i, options_.weld_m));
    int uneven = 0, holes_capped = 0;
    for (size_t i = 0; i < loops_.size(); ++i) {
      if (done[i] || around[i] >= 0) continue;
      std::vector<std::vector<int>> holes;
      for (size_t j = 0; j < loops_.size(); ++j) {
        if (j == i || done[j] || around[j] != static_cast<int>(i)) continue;
        holes.push_back(loops_[j].vertices);
        done[j] = true;
      }
      done[i] = true;
      const auto triangles = Triangulate(loops_[i], holes);
      if (triangles.empty()) return {};
      caps.insert(caps.end(), triangles.begin(), triangles.end());
      ++holes_capped;
      constexpr double kPlanar = 1e-4;
      if (loops_[i].deviation_m > std::max(options_.weld_m, kPlanar * loops_[i].diagonal_m)) ++uneven;
    }
    if (std::find(done.begin(), done.end(), false) != done.end()) return {};
    std::vector<int> body = patch_;
    for (const auto& triangle : caps) AddTo(triangle, &body);
    counts_.capped_holes += holes_capped;
    counts_.uneven_holes += uneven;
    return body;
  }

  std::vector<std::array<int, 3>> Triangulate(const MeshLoop& outline,
                                              const std::vector<std::vector<int>>& holes) const {
    const auto span = SpanOf(outline.normal);
    std::vector<Eigen::Vector2d> points;
    std::vector<int> vertex_of;
    const auto flat = [&, x = span.first, y = span.second](const std::vector<int>& loop) {
      std::vector<int> ring;
      for (const int v : loop) {
        ring.push_back(static_cast<int>(points.size()));
        vertex_of.push_back(v);
        const Vector3d d = mesh_.at(v) - outline.centre;
        points.emplace_back(x.dot(d), y.dot(d));
      }
      return ring;
    };
    const std::vector<int> ring = flat(outline.vertices);
    std::vector<std::vector<int>> inner;
    for (const auto& hole : holes) inner.push_back(flat(hole));
    auto triangles = TriangulatePolygon(points, ring, inner);
    for (auto& triangle : triangles) {
      for (int& corner : triangle) corner = vertex_of[static_cast<size_t>(corner)];
    }
    return triangles;
  }

  /// Adds a triangle; none with equal corners, which the floor below a riser has. The surface stays closed without it.
  void AddTo(const std::array<int, 3>& triangle, std::vector<int>* body) {
    if (triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0]) return;
    body->push_back(static_cast<int>(mesh_.triangles.size()));
    mesh_.Add(triangle, TriangleOrigin::kAdded);
  }

  std::vector<int> Thicken() {
    constexpr double kLevel = 0.7, kFewSteep = 1e-3;
    if (std::abs(shape_.mean_normal.z()) <= kLevel) {
      ++counts_.thickened_walls;
      return ThickenAlongNormals(0.5 * options_.wall_thickness_m, -0.5 * options_.wall_thickness_m);
    }
    if (shape_.mean_normal.z() < 0.0) TurnPatch();
    ++counts_.thickened_ground;
    const double thickness_m = options_.ground_thickness_m;
    double floor_m = std::numeric_limits<double>::infinity();
    for (const int t : patch_) {
      for (const int v : mesh_.triangles[static_cast<size_t>(t)]) floor_m = std::min(floor_m, mesh_.at(v).z());
    }
    const bool steps = shape_.steep_share > kFewSteep;
    std::map<int, int> below;
    std::map<std::array<double, 3>, int> places;  // both ends of a riser's vertical edge have one place on the floor
    for (const int v : CornersOfPatch()) {
      const Vector3d top = mesh_.at(v);
      const double z = (steps ? floor_m : top.z()) - thickness_m;
      const auto [it, fresh] = places.try_emplace({top.x(), top.y(), z});
      if (fresh) it->second = AddVertex({top.x(), top.y(), z});
      below[v] = it->second;
    }
    return JoinFaces(below);
  }

  std::vector<int> ThickenOutwards() {
    ++counts_.thickened_walls;
    return ThickenAlongNormals(0.0, -options_.wall_thickness_m);  // the faces look inwards
  }

  void TurnPatch() {
    for (const int t : patch_) mesh_.Turn(t);
    for (RimEdge& edge : rim_) std::swap(edge.from, edge.to);
  }

  std::vector<int> CornersOfPatch() const {
    std::vector<int> corners;
    for (const int t : patch_) {
      const auto& triangle = mesh_.triangles[static_cast<size_t>(t)];
      corners.insert(corners.end(), triangle.begin(), triangle.end());
    }
    std::sort(corners.begin(), corners.end());
    corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
    return corners;
  }

  int AddVertex(const Vector3d& position) {
    mesh_.vertices.emplace_back(position.cast<float>().cast<double>());  // meshes are stored in float
    return static_cast<int>(mesh_.vertices.size()) - 1;
  }

  /// Moves the patch by `front_m` and its copy by `back_m` along the normals; at creases so far that both faces are
  /// parallel to the patch.
  std::vector<int> ThickenAlongNormals(double front_m, double back_m) {
    std::map<int, std::vector<Vector3d>> normals;
    std::map<int, Vector3d> sums;
    for (const int t : patch_) {
      const Vector3d cross = mesh_.Cross(mesh_.triangles[static_cast<size_t>(t)]);
      for (const int v : mesh_.triangles[static_cast<size_t>(t)]) {
        normals[v].push_back(cross.normalized());
        sums.try_emplace(v, Vector3d::Zero()).first->second += cross;
      }
    }
    std::map<int, int> front, back;
    for (const int v : CornersOfPatch()) {
      const Vector3d offset = OffsetAt(normals.at(v), sums.at(v));
      const Vector3d position = mesh_.at(v);
      back[v] = AddVertex(position + back_m * offset);
      front[v] = front_m == 0.0 ? v : AddVertex(position + front_m * offset);
    }
    for (const int t : patch_) {
      for (int& corner : mesh_.triangles[static_cast<size_t>(t)]) corner = front.at(corner);
    }
    for (RimEdge& edge : rim_) edge = {front.at(edge.from), front.at(edge.to), edge.triangle};
    std::map<int, int> behind;
    for (const auto& [v, place] : back) behind[front.at(v)] = place;
    return JoinFaces(behind);
  }

  /// Returns the offset with dot product 1 with every distinct normal of the faces at a vertex, in the least-squares
  /// sense, and at most four times as long as the normal.
  static Vector3d OffsetAt(const std::vector<Vector3d>& normals, const Vector3d& sum) {
    Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
    Vector3d rhs = Vector3d::Zero();
    std::vector<Vector3d> distinct;
    constexpr double kSame = 0.9999;
    for (const Vector3d& n : normals) {
      if (!n.allFinite()) continue;
      if (std::any_of(distinct.begin(), distinct.end(), [&](const Vector3d& d) { return d.dot(n) > kSame; })) continue;
      distinct.push_back(n);
      matrix += n * n.transpose();
      rhs += n;
    }
    const Vector3d mean = sum.norm() > 0.0 ? Vector3d(sum.normalized()) : Vector3d(Vector3d::UnitZ());
    if (distinct.empty()) return mean;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(matrix);
    Vector3d offset = Vector3d::Zero();
    constexpr double kRank = 1e-3;
    for (int k = 0; k < 3; ++k) {
      if (eigen.eigenvalues()[k] < kRank) continue;
      offset += eigen.eigenvectors().col(k) * (eigen.eigenvectors().col(k).dot(rhs) / eigen.eigenvalues()[k]);
    }
    constexpr double kMaxMitre = 4.0;
    if (offset.norm() > kMaxMitre) offset *= kMaxMitre / offset.norm();
    return offset.dot(mean) > 0.0 ? offset : mean;
  }

  /// Adds the reversed copy of the patch and the sides along its rim.
  std::vector<int> JoinFaces(const std::map<int, int>& other) {
    std::vector<int> body = patch_;
    for (const int t : patch_) {
      const auto [a, b, c] = mesh_.triangles[static_cast<size_t>(t)];
      AddTo({other.at(a), other.at(c), other.at(b)}, &body);
    }
    for (const RimEdge& edge : rim_) {
      AddTo({edge.to, edge.from, other.at(edge.from)}, &body);
      AddTo({edge.to, other.at(edge.from), other.at(edge.to)}, &body);
    }
    return body;
  }

  const std::vector<int>& patch_;
  const MeshRepairOptions& options_;
  MarkedMesh& mesh_;
  MeshRepairCounts& counts_;
  PatchShape shape_;
  std::vector<RimEdge> rim_;
  std::map<std::pair<int, int>, int> triangle_of_;  ///< triangle at an edge of a loop
  std::vector<MeshLoop> loops_;
};

}  // namespace

std::vector<std::vector<int>> ClosePatches(const std::vector<std::vector<int>>& patches,
                                           const MeshRepairOptions& options, MarkedMesh* mesh,
                                           MeshRepairCounts* counts) {
  std::vector<std::vector<int>> closed;
  for (const std::vector<int>& patch : JoinNested(*mesh, patches, options.weld_m)) {
    std::vector<int> body = PatchCloser(patch, options, mesh, counts).Close();
    if (!body.empty()) closed.push_back(std::move(body));
  }
  return closed;
}

}  // namespace legopt

#include "legopt/geometry/internal/scene_solids.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "legopt/geometry/internal/convex_decomposition.h"
#include "legopt/geometry/internal/mesh_bodies.h"
#include "legopt/types/input_error.h"

namespace legopt {
namespace {

constexpr double kSurfaceThickness = 2e-5;  // minimum height of a triangle in plan, m; below it the triangle is a wall
                                            // or a sliver

double PlanCross(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

double PlanDistance(const Eigen::Vector3d& a, const Eigen::Vector3d& b) { return (b - a).head<2>().norm(); }

/// Returns the triangle's height in plan over its longest side; > 0 if it faces up.
double PlanHeight(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const double longest = std::max({PlanDistance(a, b), PlanDistance(b, c), PlanDistance(c, a)});
  return longest > 0.0 ? PlanCross(a, b, c) / longest : 0.0;
}

/// One of the two surfaces of a prism: its triangles and their common plane.
struct Surface {
  std::vector<std::array<int, 3>> triangles;
  double plan_area_m2 = 0.0;
  Eigen::Vector3d plane = Eigen::Vector3d::Zero();

  /// Fits a plane to all corners by least squares, weighted by area. Returns false if a corner deviates by more than
  /// the tolerance.
  bool FitPlane(const std::vector<Eigen::Vector3d>& vertices, double tolerance_m) {
    if (triangles.empty()) return false;
    const Eigen::Vector3d& origin = vertices[static_cast<size_t>(triangles.front()[0])];
    Eigen::Matrix3d normal_matrix = Eigen::Matrix3d::Zero();
    Eigen::Vector3d rhs = Eigen::Vector3d::Zero();
    ForEachCorner(vertices, [&](const Eigen::Vector3d& p, double weight) {
      const Eigen::Vector3d row(1.0, p.x() - origin.x(), p.y() - origin.y());
      normal_matrix += weight * row * row.transpose();
      rhs += weight * (p.z() - origin.z()) * row;
    });
    const Eigen::Vector3d local = normal_matrix.ldlt().solve(rhs);
    if (!local.allFinite()) return false;
    plane = Eigen::Vector3d(local[0] + origin.z() - local[1] * origin.x() - local[2] * origin.y(), local[1], local[2]);
    bool fits = true;
    ForEachCorner(vertices, [&](const Eigen::Vector3d& p, double) {
      fits = fits && std::abs(plane[0] + plane[1] * p.x() + plane[2] * p.y() - p.z()) <= tolerance_m;
    });
    return fits;
  }

 private:
  template <class Visitor>
  void ForEachCorner(const std::vector<Eigen::Vector3d>& vertices, Visitor visit) const {
    for (const auto& t : triangles) {
      const auto at = [&](int k) -> const Eigen::Vector3d& {
        return vertices[static_cast<size_t>(t[static_cast<size_t>(k)])];
      };
      const double weight = std::abs(PlanCross(at(0), at(1), at(2)));
      for (int k = 0; k < 3; ++k) visit(at(k), weight);
    }
  }
};

double PlaneZ(const Eigen::Vector3d& plane, const Eigen::Vector3d& p) {
  return plane[0] + plane[1] * p.x() + plane[2] * p.y();
}

/// Greedy merging of convex polygons in plan over shared vertices.
class PolygonMerger {
 public:
  PolygonMerger(const std::vector<Eigen::Vector3d>& vertices, double dent_m) : vertices_(vertices), dent_m_(dent_m) {}

  void Add(const std::array<int, 3>& triangle) {
    const int id = static_cast<int>(polygons_.size());
    polygons_.push_back({triangle.begin(), triangle.end()});
    Own(id);
  }

  std::vector<std::vector<int>> Merge() {
    std::vector<std::pair<int, int>> inner;
    for (const auto& [edge, id] : owner_) {
      if (edge.first < edge.second && owner_.count({edge.second, edge.first}) > 0) inner.push_back(edge);
    }
    const auto length = [&](const auto& e) { return PlanDistance(At(e.first), At(e.second)); };
    std::stable_sort(inner.begin(), inner.end(), [&](const auto& a, const auto& b) { return length(a) > length(b); });
    bool merged = true;
    while (merged) {  // a merge can enable one that failed before
      merged = false;
      for (const auto& edge : inner) merged = TryMerge(edge) || merged;
    }
    std::vector<std::vector<int>> result;
    for (auto& polygon : polygons_) {
      if (!polygon.empty()) result.push_back(std::move(polygon));
    }
    return result;
  }

 private:
  const Eigen::Vector3d& At(int i) const { return vertices_[static_cast<size_t>(i)]; }

  bool TryMerge(const std::pair<int, int>& edge) {
    const auto left = owner_.find(edge);
    const auto right = owner_.find({edge.second, edge.first});
    if (left == owner_.end() || right == owner_.end() || left->second == right->second) return false;
    const int keep = left->second;
    const int drop = right->second;
    std::vector<int> joined = Join(polygons_[static_cast<size_t>(keep)], polygons_[static_cast<size_t>(drop)], edge);
    if (!Convex(joined)) return false;
    for (int id : {keep, drop}) {
      const auto& polygon = polygons_[static_cast<size_t>(id)];
      for (size_t k = 0; k < polygon.size(); ++k) {
        const auto it = owner_.find({polygon[k], polygon[(k + 1) % polygon.size()]});
        if (it != owner_.end() && it->second == id) owner_.erase(it);
      }
    }
    polygons_[static_cast<size_t>(keep)] = std::move(joined);
    polygons_[static_cast<size_t>(drop)].clear();
    Own(keep);
    return true;
  }

  /// Registers the polygon's edges. If surfaces overlap, an edge may occur twice; the first polygon keeps it.
  void Own(int id) {
    const auto& polygon = polygons_[static_cast<size_t>(id)];
    for (size_t k = 0; k < polygon.size(); ++k) {
      owner_.try_emplace({polygon[k], polygon[(k + 1) % polygon.size()]}, id);
    }
  }

  /// Joins both outlines without the shared edge and removes spurs left by further shared edges.
  static std::vector<int> Join(std::vector<int> left, std::vector<int> right, const std::pair<int, int>& edge) {
    // left becomes (second ... first), right becomes (first ... second)
    std::rotate(left.begin(), std::find(left.begin(), left.end(), edge.second), left.end());
    std::rotate(right.begin(), std::find(right.begin(), right.end(), edge.first), right.end());
    left.insert(left.end(), right.begin() + 1, right.end() - 1);
    for (size_t i = 0; left.size() > 2 && i < left.size();) {
      const size_t n = left.size();
      if (left[(i + n - 1) % n] == left[(i + 1) % n]) {
        std::rotate(left.begin(), left.begin() + static_cast<std::ptrdiff_t>(i), left.end());
        left.erase(left.begin(), left.begin() + 2);
        i = 0;
      } else {
        ++i;
      }
    }
    return left;
  }

  bool Convex(const std::vector<int>& polygon) const {
    const size_t n = polygon.size();
    if (n < 3) return false;
    double turned = 0.0;
    for (size_t i = 0; i < n; ++i) {
      const Eigen::Vector3d& a = At(polygon[i]);
      const Eigen::Vector3d& b = At(polygon[(i + 1) % n]);
      const Eigen::Vector3d& c = At(polygon[(i + 2) % n]);
      const double base = PlanDistance(a, c);
      if (PlanCross(a, b, c) < -dent_m_ * base || base == 0.0) return false;
      turned += std::atan2(PlanCross(a, b, c), (b - a).head<2>().dot((c - b).head<2>()));
    }
    constexpr double kOneTurn = 2.0 * M_PI;
    if (std::abs(turned - kOneTurn) > 1e-6) return false;
    return DentsAreShallow(polygon);
  }

  /// Rejects polygons whose small dents add up: no corner may be deeper than the dent limit behind the chord of any two
  /// others.
  bool DentsAreShallow(const std::vector<int>& polygon) const {
    const size_t n = polygon.size();
    for (size_t i = 0; i < n; ++i) {
      const Eigen::Vector3d& a = At(polygon[i]);
      for (size_t j = i + 2; j < n; ++j) {
        const Eigen::Vector3d& c = At(polygon[j]);
        const double allowed = -dent_m_ * PlanDistance(a, c);
        for (size_t k = 0; k < n; ++k) {
          const double side = PlanCross(a, At(polygon[k]), c);
          if ((k > i && k < j ? side : -side) < allowed && k != i && k != j) return false;
        }
      }
    }
    return true;
  }

  const std::vector<Eigen::Vector3d>& vertices_;
  const double dent_m_;
  std::vector<std::vector<int>> polygons_;
  std::map<std::pair<int, int>, int> owner_;  ///< polygon to the left of each directed edge
};

/// Top triangles of several prisms over welded vertices.
class WeldedTops {
 public:
  void Add(const VerticalPrism& prism) {
    for (const auto& t : prism.triangles) {
      std::array<int, 3> corners{};
      for (size_t k = 0; k < 3; ++k) corners[k] = Weld(prism.vertices[static_cast<size_t>(t[k])]);
      if (corners[0] != corners[1] && corners[1] != corners[2] && corners[2] != corners[0])
        triangles.push_back(corners);
    }
  }

  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<int, 3>> triangles;

 private:
  int Weld(const Eigen::Vector3d& p) {
    const auto [it, inserted] = index_.try_emplace({p.x(), p.y()}, static_cast<int>(vertices.size()));
    if (inserted) vertices.push_back(p);
    return it->second;
  }
  std::map<std::pair<double, double>, int> index_;
};

/// Returns true if the planes of both prisms agree over the extent of both.
bool SamePlanes(const VerticalPrism& a, const VerticalPrism& b, double tolerance_m) {
  for (const VerticalPrism* prism : {&a, &b}) {
    for (const Eigen::Vector3d& p : prism->vertices) {
      if (std::abs(PlaneZ(a.top, p) - PlaneZ(b.top, p)) > tolerance_m) return false;
      if (std::abs(PlaneZ(a.bottom, p) - PlaneZ(b.bottom, p)) > tolerance_m) return false;
    }
  }
  return true;
}

}  // namespace

std::optional<VerticalPrism> RecogniseVerticalPrism(const TriangleMesh& component, double tolerance_m) {
  Surface top;
  Surface bottom;
  for (const auto& t : component.triangles) {
    const auto at = [&](int k) -> const Eigen::Vector3d& {
      return component.vertices[static_cast<size_t>(t[static_cast<size_t>(k)])];
    };
    const double height = PlanHeight(at(0), at(1), at(2));
    if (std::abs(height) < kSurfaceThickness) continue;
    Surface& surface = height > 0.0 ? top : bottom;
    surface.triangles.push_back(t);
    surface.plan_area_m2 += 0.5 * std::abs(PlanCross(at(0), at(1), at(2)));
  }
  constexpr double kAreaMismatch = 0.01;
  if (std::abs(top.plan_area_m2 - bottom.plan_area_m2) > kAreaMismatch * top.plan_area_m2) return std::nullopt;
  if (!top.FitPlane(component.vertices, tolerance_m) || !bottom.FitPlane(component.vertices, tolerance_m))
    return std::nullopt;
  VerticalPrism prism{top.plane, bottom.plane, component.vertices, std::move(top.triangles)};
  for (const auto& t : prism.triangles) {
    for (int corner : t) {
      const Eigen::Vector3d& p = prism.vertices[static_cast<size_t>(corner)];
      if (PlaneZ(prism.top, p) <= PlaneZ(prism.bottom, p)) return std::nullopt;
    }
  }
  return prism;
}

std::vector<std::vector<Eigen::Vector3d>> CutIntoConvexPrisms(const std::vector<VerticalPrism>& prisms, double dent_m) {
  constexpr double kSamePlane = 2e-5;
  std::vector<std::vector<Eigen::Vector3d>> pieces;
  std::vector<bool> taken(prisms.size(), false);
  for (size_t i = 0; i < prisms.size(); ++i) {
    if (taken[i]) continue;
    WeldedTops tops;
    for (size_t j = i; j < prisms.size(); ++j) {
      if (taken[j] || (j != i && !SamePlanes(prisms[i], prisms[j], kSamePlane))) continue;
      taken[j] = true;
      tops.Add(prisms[j]);
    }
    PolygonMerger merger(tops.vertices, dent_m);
    for (const auto& t : tops.triangles) merger.Add(t);
    for (const auto& polygon : merger.Merge()) {
      std::vector<Eigen::Vector3d>& piece = pieces.emplace_back();
      for (int corner : polygon) {
        Eigen::Vector3d p = tops.vertices[static_cast<size_t>(corner)];
        for (const Eigen::Vector3d* plane : {&prisms[i].top, &prisms[i].bottom}) {
          p.z() = PlaneZ(*plane, p);
          piece.push_back(p);
        }
      }
    }
  }
  return pieces;
}

namespace {

/// A decomposed component, stored so that copies elsewhere in the scene (cars, chairs) are not decomposed again.
struct Known {
  TriangleMesh mesh;
  std::vector<ConvexHull> pieces;
};

/// Finds the rigid motion from `from` to `to`. Returns false if the meshes differ by more than a motion and the
/// rounding of a mesh file.
bool FindMotion(const TriangleMesh& from, const TriangleMesh& to, Eigen::Isometry3d& motion) {
  if (from.triangles != to.triangles || from.vertices.size() != to.vertices.size()) return false;
  const auto n = static_cast<Eigen::Index>(from.vertices.size());
  const Eigen::Map<const Eigen::Matrix3Xd> source(from.vertices.front().data(), 3, n);
  const Eigen::Map<const Eigen::Matrix3Xd> target(to.vertices.front().data(), 3, n);
  motion.matrix() = Eigen::umeyama(source, target, false);
  constexpr double kRounding = 2e-5;  // m; rounding of float coordinates tens of metres from the origin
  const Eigen::Matrix3Xd moved = (motion.linear() * source).colwise() + motion.translation();
  return (moved - target).colwise().norm().maxCoeff() <= kRounding;
}

ConvexHull Moved(const ConvexHull& hull, const Eigen::Isometry3d& motion) {
  ConvexHull result = hull;
  for (Eigen::Vector3d& v : result.vertices) v = motion * v;
  for (HalfSpace& facet : result.facets) {
    facet.normal = motion.linear() * facet.normal;
    facet.offset -= facet.normal.dot(motion.translation());
  }
  return result;
}

class MeshSolids {
 public:
  explicit MeshSolids(const CollisionOptions& options)
      : limits_{options.scene_concavity_m, options.max_component_pieces} {}

  void Add(const TriangleMesh& mesh) {
    for (TriangleMesh& component : SplitIntoComponents(mesh)) AddComponent(std::move(component));
    for (const auto& corners : CutIntoConvexPrisms(prisms_)) {
      ConvexHull hull = ComputeHull(corners);
      constexpr double kNothing = 1e-9;  // m^3; volume of slivers left over by clipping
      if (hull.volume_m3 > kNothing) solids_.push_back(ConvexShape::FromHull(std::move(hull)));
    }
    prisms_.clear();
  }

  std::vector<ConvexShape> Take() { return std::move(solids_); }

 private:
  void AddComponent(TriangleMesh component) {
    ConvexHull hull = ComputeHull(component.vertices);
    // Prisms first: neighbours with the same planes are joined, which reduces the number of solids.
    if (std::optional<VerticalPrism> prism = RecogniseVerticalPrism(component)) {
      prisms_.push_back(std::move(*prism));
    } else if (IsConvex(component, hull)) {
      solids_.push_back(ConvexShape::FromHull(std::move(hull)));
    } else {
      Decompose(std::move(component));
    }
  }

  void Decompose(TriangleMesh component) {
    for (const Known& known : known_) {
      Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
      if (!FindMotion(known.mesh, component, motion)) continue;
      for (const ConvexHull& piece : known.pieces) solids_.push_back(ConvexShape::FromHull(Moved(piece, motion)));
      return;
    }
    std::vector<ConvexHull> pieces = DecomposeApproximately(component, limits_);
    for (const ConvexHull& piece : pieces) solids_.push_back(ConvexShape::FromHull(piece));
    known_.push_back({std::move(component), std::move(pieces)});
  }

  DecompositionLimits limits_;
  std::vector<VerticalPrism> prisms_;
  std::vector<Known> known_;
  std::vector<ConvexShape> solids_;
};

/// Calls action(shape) for all objects and adds the object's name to any InputError.
template <class Action>
void ForEachObject(const Scene& scene, Action action) {
  for (const SceneObject& object : scene.objects) {
    try {
      action(object.shape);
    } catch (const InputError& error) {
      InputError::Fault fault = error.fault();
      fault.field = "scene object '" + object.name + "'" + (fault.field.empty() ? "" : ": " + fault.field);
      throw InputError(std::move(fault));
    }
  }
}

}  // namespace

std::vector<ConvexShape> SolidsOfMesh(const TriangleMesh& mesh, const CollisionOptions& options) {
  MeshSolids solids(options);
  solids.Add(mesh);
  return solids.Take();
}

std::vector<ConvexShape> BuildSceneSolids(const Scene& scene, const CollisionOptions& options) {
  std::vector<ConvexShape> solids;
  ForEachObject(scene, [&](const ShapeSpec& shape) {
    if (shape.kind == ShapeSpec::Kind::kMesh) {
      for (ConvexShape& solid : SolidsOfMesh(Tessellate(shape, scene.read_guard), options))
        solids.push_back(std::move(solid));
    } else {
      solids.push_back(ConvexShape::FromPrimitive(shape));
    }
  });
  return solids;
}

TriangleMesh CollectSceneTriangles(const Scene& scene) {
  TriangleMesh all;
  ForEachObject(scene, [&](const ShapeSpec& shape) {
    const TriangleMesh mesh = Tessellate(shape, scene.read_guard);
    const int first = static_cast<int>(all.vertices.size());
    all.vertices.insert(all.vertices.end(), mesh.vertices.begin(), mesh.vertices.end());
    for (const auto& [a, b, c] : mesh.triangles) all.triangles.push_back({first + a, first + b, first + c});
  });
  return all;
}

}  // namespace legopt

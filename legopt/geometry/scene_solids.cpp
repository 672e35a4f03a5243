#include "legopt/geometry/scene_solids.h"

#include <Eigen/Dense>
#include <utility>

#include "legopt/geometry/convex_decomposition.h"
#include "legopt/geometry/mesh_components.h"
#include "legopt/geometry/prism_decomposition.h"
#include "legopt/types/input_error.h"

namespace legopt {
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

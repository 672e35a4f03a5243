#include "legopt/geometry/trimesh_world.h"

#include <ode/ode.h>

#include <algorithm>
#include <mutex>
#include <optional>
#include <utility>

#include "legopt/geometry/ode_runtime.h"
#include "legopt/geometry/triangle_depth.h"

namespace legopt {
namespace {

/// A mesh with the coordinates and indices that ODE refers to.
struct Mesh {
  explicit Mesh(TriangleMesh mesh) : triangles(std::move(mesh)), bvh(triangles) {}

  TriangleMesh triangles;
  TriangleBvh bvh;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  std::vector<dReal> coordinates;
  std::vector<dTriIndex> indices;
  dTriMeshDataID data = nullptr;
  dGeomID geom = nullptr;
};

constexpr int kCoordinatesPerVertex = 3;

// Debian builds ODE without thread-local storage: all mesh colliders of the process share one cache, whatever
// dAllocateODEDataForThread allocates. So worlds of several threads must take turns.
std::mutex& ColliderCache() {
  static std::mutex mutex;
  return mutex;
}

}  // namespace

struct TrimeshWorld::Impl {
  std::vector<std::unique_ptr<Mesh>> meshes;
  std::vector<dContactGeom> contacts = std::vector<dContactGeom>(kOriginalContacts);
  std::int64_t ode_failures = 0;

  ~Impl() {
    for (const auto& mesh : meshes) {
      dGeomDestroy(mesh->geom);
      dGeomTriMeshDataDestroy(mesh->data);
    }
  }
  const Mesh& at(int mesh) const { return *meshes[static_cast<size_t>(mesh)]; }
  dGeomID geom(int mesh) const { return at(mesh).geom; }

  /// Returns false for a single triangle: ODE's tree for it is a null pointer that its collider dereferences.
  bool IsSupportedByOde(int mesh) const { return at(mesh).triangles.triangles.size() > 1; }

  /// Collides two meshes and returns the number of contacts, at most kOriginalContacts, which are stored in `contacts`.
  /// Empty if ODE cannot answer, because a mesh is not known to it or an assertion failed. Its contact table has four
  /// places per bucket; removing a contact that did not fit fails an assertion.
  std::optional<int> Collide(int mesh_a, int mesh_b) {
    if (!IsSupportedByOde(mesh_a) || !IsSupportedByOde(mesh_b)) return std::nullopt;
    UseOdeOnThisThread();
    const std::scoped_lock lock(ColliderCache());
    try {
      return dCollide(geom(mesh_a), geom(mesh_b), kOriginalContacts, contacts.data(), sizeof(dContactGeom));
    } catch (const OdeFailure&) {
      ++ode_failures;
      return std::nullopt;
    }
  }
  /// Returns the largest depth of the first `count` contacts; -1 if there are none.
  double Deepest(int count) const {
    double depth = -1.0;
    for (int i = 0; i < count; ++i)
      depth = std::max(depth, static_cast<double>(contacts[static_cast<size_t>(i)].depth));
    return depth;
  }
};

TrimeshWorld::TrimeshWorld() : impl_(std::make_unique<Impl>()) { UseOdeOnThisThread(); }
TrimeshWorld::~TrimeshWorld() = default;

int TrimeshWorld::Add(TriangleMesh triangles) {
  UseOdeOnThisThread();
  auto entry = std::make_unique<Mesh>(std::move(triangles));
  const TriangleMesh& mesh = entry->triangles;
  entry->coordinates.reserve(kCoordinatesPerVertex * mesh.vertices.size());
  for (const Eigen::Vector3d& v : mesh.vertices)
    entry->coordinates.insert(entry->coordinates.end(), {v.x(), v.y(), v.z()});
  for (const auto& t : mesh.triangles) {
    for (int corner : t) entry->indices.push_back(static_cast<dTriIndex>(corner));
  }
  entry->data = dGeomTriMeshDataCreate();
  dGeomTriMeshDataBuildDouble(entry->data, entry->coordinates.data(), kCoordinatesPerVertex * sizeof(dReal),
                              static_cast<int>(mesh.vertices.size()), entry->indices.data(),
                              static_cast<int>(entry->indices.size()), 3 * sizeof(dTriIndex));
  entry->geom = dCreateTriMesh(nullptr, entry->data, nullptr, nullptr, nullptr);
  impl_->meshes.push_back(std::move(entry));
  return static_cast<int>(impl_->meshes.size()) - 1;
}

void TrimeshWorld::SetPose(int mesh, const Eigen::Isometry3d& pose) {
  impl_->meshes[static_cast<size_t>(mesh)]->pose = pose;
  const Eigen::Matrix3d& r = pose.linear();
  const dMatrix3 rotation = {r(0, 0), r(0, 1), r(0, 2), 0, r(1, 0), r(1, 1), r(1, 2), 0, r(2, 0), r(2, 1), r(2, 2), 0};
  dGeomSetRotation(impl_->geom(mesh), rotation);
  dGeomSetPosition(impl_->geom(mesh), pose.translation().x(), pose.translation().y(), pose.translation().z());
}

double TrimeshWorld::Depth(int mesh_a, int mesh_b) {
  const std::optional<int> count = impl_->Collide(mesh_a, mesh_b);
  return count ? impl_->Deepest(*count) : ExactDepth(mesh_a, mesh_b);
}

TrimeshWorld::Depths TrimeshWorld::AllDepths(int mesh_a, int mesh_b) {
  const std::optional<int> count = impl_->Collide(mesh_a, mesh_b);
  Depths depths;
  if (!count) {
    depths.original_m = depths.all_m = ExactDepth(mesh_a, mesh_b);
    return depths;
  }
  depths.original_m = depths.all_m = impl_->Deepest(*count);
  if (*count < kOriginalContacts) return depths;
  depths.all_m = std::max(depths.original_m, ExactDepth(mesh_a, mesh_b));
  return depths;
}

double TrimeshWorld::ExactDepth(int mesh_a, int mesh_b) const {
  const bool a_is_larger = impl_->at(mesh_a).triangles.triangles.size() >= impl_->at(mesh_b).triangles.triangles.size();
  const Mesh& large = impl_->at(a_is_larger ? mesh_a : mesh_b);
  const Mesh& small = impl_->at(a_is_larger ? mesh_b : mesh_a);
  return MeshDepth(large.triangles, large.bvh, small.triangles, large.pose.inverse(Eigen::Isometry) * small.pose);
}

std::int64_t TrimeshWorld::ode_failures() const { return impl_->ode_failures; }

MeshCrossing TrimeshWorld::Crossing(int mesh_a, int mesh_b) const {
  const Mesh &a = impl_->at(mesh_a), &b = impl_->at(mesh_b);
  MeshCrossing crossing = DeepestCrossing(a.triangles, a.bvh, b.triangles, a.pose.inverse(Eigen::Isometry) * b.pose);
  crossing.point_a = a.pose * crossing.point_a;
  crossing.point_b = a.pose * crossing.point_b;
  return crossing;
}

const TriangleMesh& TrimeshWorld::triangles(int mesh) const { return impl_->at(mesh).triangles; }
const TriangleBvh& TrimeshWorld::bvh(int mesh) const { return impl_->at(mesh).bvh; }

}  // namespace legopt

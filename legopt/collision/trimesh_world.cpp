#include "legopt/collision/trimesh_world.h"

#include <ode/ode.h>

#include <algorithm>

#include "legopt/collision/ode_runtime.h"

namespace legopt {
namespace {

/// Coordinates and indices stay with ODE's mesh: ODE refers to them.
struct Mesh {
  std::vector<dReal> coordinates;
  std::vector<dTriIndex> indices;
  dTriMeshDataID data = nullptr;
  dGeomID geom = nullptr;
};

constexpr int kCoordinatesPerVertex = 3;

}  // namespace

struct TrimeshWorld::Impl {
  std::vector<std::unique_ptr<Mesh>> meshes;
  std::vector<dContactGeom> contacts = std::vector<dContactGeom>(kOriginalContacts);

  ~Impl() {
    for (const auto& mesh : meshes) {
      dGeomDestroy(mesh->geom);
      dGeomTriMeshDataDestroy(mesh->data);
    }
  }
  dGeomID geom(int mesh) const { return meshes[static_cast<size_t>(mesh)]->geom; }

  /// Number of contacts, at most `max_contacts`, which are left in `contacts`.
  int Collide(int mesh_a, int mesh_b, int max_contacts) {
    UseOdeOnThisThread();
    if (contacts.size() < static_cast<size_t>(max_contacts)) contacts.resize(static_cast<size_t>(max_contacts));
    return dCollide(geom(mesh_a), geom(mesh_b), max_contacts, contacts.data(), sizeof(dContactGeom));
  }
  /// Largest depth of the first contacts; -1 without any.
  double Deepest(int count) const {
    double depth = -1.0;
    for (int i = 0; i < count; ++i)
      depth = std::max(depth, static_cast<double>(contacts[static_cast<size_t>(i)].depth));
    return depth;
  }
};

TrimeshWorld::TrimeshWorld() : impl_(std::make_unique<Impl>()) { UseOdeOnThisThread(); }
TrimeshWorld::~TrimeshWorld() = default;

int TrimeshWorld::Add(const TriangleMesh& mesh) {
  UseOdeOnThisThread();
  auto entry = std::make_unique<Mesh>();
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
  const Eigen::Matrix3d& r = pose.linear();
  const dMatrix3 rotation = {r(0, 0), r(0, 1), r(0, 2), 0, r(1, 0), r(1, 1), r(1, 2), 0, r(2, 0), r(2, 1), r(2, 2), 0};
  dGeomSetRotation(impl_->geom(mesh), rotation);
  dGeomSetPosition(impl_->geom(mesh), pose.translation().x(), pose.translation().y(), pose.translation().z());
}

double TrimeshWorld::Depth(int mesh_a, int mesh_b) {
  return impl_->Deepest(impl_->Collide(mesh_a, mesh_b, kOriginalContacts));
}

TrimeshWorld::Depths TrimeshWorld::AllDepths(int mesh_a, int mesh_b) {
  const int count = impl_->Collide(mesh_a, mesh_b, kOriginalContacts);
  Depths depths;
  depths.original_m = depths.all_m = impl_->Deepest(count);
  if (count < kOriginalContacts) return depths;
  depths.all_m = std::max(depths.original_m, impl_->Deepest(impl_->Collide(mesh_a, mesh_b, kAllContacts)));
  return depths;
}

}  // namespace legopt

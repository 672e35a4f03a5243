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
  std::vector<dContactGeom> contacts = std::vector<dContactGeom>(kMaxContacts);

  ~Impl() {
    for (const auto& mesh : meshes) {
      dGeomDestroy(mesh->geom);
      dGeomTriMeshDataDestroy(mesh->data);
    }
  }
  dGeomID geom(int mesh) const { return meshes[static_cast<size_t>(mesh)]->geom; }
};

TrimeshWorld::TrimeshWorld() : impl_(std::make_unique<Impl>()) { UseOdeOnThisThread(); }
TrimeshWorld::~TrimeshWorld() = default;

int TrimeshWorld::Add(TriangleMesh mesh) {
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
  UseOdeOnThisThread();
  const int count =
      dCollide(impl_->geom(mesh_a), impl_->geom(mesh_b), kMaxContacts, impl_->contacts.data(), sizeof(dContactGeom));
  double depth = -1.0;
  for (int i = 0; i < count; ++i)
    depth = std::max(depth, static_cast<double>(impl_->contacts[static_cast<size_t>(i)].depth));
  return depth;
}

}  // namespace legopt

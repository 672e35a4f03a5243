#include "legopt/geometry/internal/trimesh_world.h"

#include <ode/ode.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>
#include <utility>

#include "legopt/geometry/internal/ode_world.h"

namespace legopt {
namespace {

using Eigen::Vector3d;

constexpr double kApart = -1.0;

/// Plane of a triangle with outward unit normal; the normal is zero for a triangle without area.
struct Plane {
  Vector3d normal = Vector3d::Zero();
  Vector3d point = Vector3d::Zero();

  explicit Plane(const TriangleCorners& t) : point(t[0]) {
    const Vector3d cross = (t[1] - t[0]).cross(t[2] - t[0]);
    const double norm = cross.norm();
    if (norm > 0.0) normal = cross / norm;
  }
  double Height(const Vector3d& p) const { return normal.dot(p - point); }
};

std::array<double, 3> Heights(const Plane& plane, const TriangleCorners& t) {
  return {plane.Height(t[0]), plane.Height(t[1]), plane.Height(t[2])};
}

bool OnOneSide(const std::array<double, 3>& h) {
  return (h[0] > 0.0 && h[1] > 0.0 && h[2] > 0.0) || (h[0] < 0.0 && h[1] < 0.0 && h[2] < 0.0);
}

/// Returns the interval in which a triangle intersects the other's plane: coordinates along the planes' common line.
std::array<double, 2> Cut(const TriangleCorners& t, const std::array<double, 3>& h, const Vector3d& line) {
  std::array<double, 2> cut = {std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  const auto include = [&](double s) {
    cut[0] = std::min(cut[0], s);
    cut[1] = std::max(cut[1], s);
  };
  for (size_t i = 0; i < 3; ++i) {
    const size_t j = (i + 1) % 3;
    if (h[i] == 0.0) include(line.dot(t[i]));
    if ((h[i] < 0.0 && h[j] > 0.0) || (h[i] > 0.0 && h[j] < 0.0)) {
      include(line.dot(t[i]) + (line.dot(t[j]) - line.dot(t[i])) * h[i] / (h[i] - h[j]));
    }
  }
  return cut;
}

/// Returns true if two triangles cross (Moeller's interval test).
bool Cross(const TriangleCorners& a, const Plane& plane_a, const TriangleCorners& b, const Plane& plane_b) {
  const std::array<double, 3> heights_b = Heights(plane_a, b);
  if (OnOneSide(heights_b)) return false;
  const std::array<double, 3> heights_a = Heights(plane_b, a);
  if (OnOneSide(heights_a)) return false;
  const Vector3d line = plane_a.normal.cross(plane_b.normal);
  if (line.isZero(0.0)) return false;
  const std::array<double, 2> cut_a = Cut(a, heights_a, line), cut_b = Cut(b, heights_b, line);
  return cut_a[0] <= cut_b[1] && cut_b[0] <= cut_a[1];
}

/// A triangle clipped by up to three planes.
struct Polygon {
  static constexpr int kMaxCorners = 6;
  std::array<Vector3d, kMaxCorners> corners;
  int size = 0;

  void Add(const Vector3d& corner) {
    if (size < kMaxCorners) corners[static_cast<size_t>(size++)] = corner;
  }
};

/// Clips a polygon to n . (p - point) <= 0.
Polygon Clip(const Polygon& polygon, const Vector3d& n, const Vector3d& point) {
  Polygon rest;
  for (int i = 0; i < polygon.size; ++i) {
    const Vector3d& p = polygon.corners[static_cast<size_t>(i)];
    const Vector3d& q = polygon.corners[static_cast<size_t>((i + 1) % polygon.size)];
    const double hp = n.dot(p - point), hq = n.dot(q - point);
    if (hp <= 0.0) rest.Add(p);
    if ((hp < 0.0 && hq > 0.0) || (hp > 0.0 && hq < 0.0)) rest.Add(p + (q - p) * (hp / (hp - hq)));
  }
  return rest;
}

/// Returns the depth of `t`, clipped to the prism over `face`, behind the plane; minus infinity if nothing remains.
/// `deepest` receives the deepest point.
double DepthBehind(const TriangleCorners& face, const Plane& plane, const TriangleCorners& t,
                   Vector3d* deepest = nullptr) {
  Polygon polygon;
  for (const Vector3d& corner : t) polygon.Add(corner);
  for (size_t i = 0; i < 3 && polygon.size > 0; ++i) {
    polygon = Clip(polygon, (face[(i + 1) % 3] - face[i]).cross(plane.normal), face[i]);
  }
  double depth = -std::numeric_limits<double>::infinity();
  for (int i = 0; i < polygon.size; ++i) {
    const Vector3d& corner = polygon.corners[static_cast<size_t>(i)];
    const double behind = -plane.Height(corner);
    if (deepest != nullptr && behind > depth) *deepest = corner;
    depth = std::max(depth, behind);
  }
  return depth;
}

TriangleCorners CornersOf(const TriangleMesh& mesh, size_t triangle) {
  TriangleCorners corners;
  for (size_t k = 0; k < corners.size(); ++k) {
    corners[k] = mesh.vertices[static_cast<size_t>(mesh.triangles[triangle][k])];
  }
  return corners;
}

}  // namespace

double TriangleDepth(const TriangleCorners& a, const TriangleCorners& b) {
  const Plane plane_a(a), plane_b(b);
  if (!Cross(a, plane_a, b, plane_b)) return kApart;
  const double depth = std::min(DepthBehind(a, plane_a, b), DepthBehind(b, plane_b, a));
  return std::isfinite(depth) ? std::max(depth, 0.0) : kApart;
}

namespace {

/// Calls action(triangle of A, triangle `t` of B in the frame of A) for the triangles of A whose boxes overlap its box.
template <class Action>
void ForEachNear(const TriangleMesh& a, const TriangleBvh& bvh_a, const TriangleMesh& b, size_t t,
                 const Eigen::Isometry3d& X_AB, Action action) {
  TriangleCorners corners = CornersOf(b, t);
  Eigen::AlignedBox3d box;
  for (Vector3d& corner : corners) {
    corner = X_AB * corner;
    box.extend(corner);
  }
  bvh_a.AnyOverlapping(box, [&](int other) {
    action(CornersOf(a, static_cast<size_t>(other)), corners);
    return false;
  });
}

/// Returns a box, in the frame of A, around a box of the frame of B and the rounding of its contents' coordinates.
Eigen::AlignedBox3d BoxAround(const Eigen::AlignedBox3d& box, const Eigen::Isometry3d& X_AB) {
  constexpr double kRounding = 1e-9;  // relative and in m
  const Vector3d centre = X_AB * box.center();
  const Vector3d half = X_AB.linear().cwiseAbs() * (0.5 * box.sizes());
  const double slack = kRounding * (1.0 + centre.cwiseAbs().maxCoeff() + half.maxCoeff());
  return {centre - half - Vector3d::Constant(slack), centre + half + Vector3d::Constant(slack)};
}

}  // namespace

double MeshDepth(const TriangleMesh& a, const TriangleBvh& bvh_a, const TriangleMesh& b, const TriangleBvh& bvh_b,
                 const Eigen::Isometry3d& X_AB) {
  double deepest = kApart;
  const auto near = [&](const Eigen::AlignedBox3d& box) {
    return bvh_a.AnyOverlapping(BoxAround(box, X_AB), [](int) { return true; });
  };
  bvh_b.ForEachNear(near, [&](int t) {
    ForEachNear(a, bvh_a, b, static_cast<size_t>(t), X_AB,
                [&](const auto& of_a, const auto& of_b) { deepest = std::max(deepest, TriangleDepth(of_a, of_b)); });
  });
  return deepest;
}

MeshCrossing DeepestCrossing(const TriangleMesh& a, const TriangleBvh& bvh_a, const TriangleMesh& b,
                             const Eigen::Isometry3d& X_AB) {
  MeshCrossing deepest;
  TriangleCorners triangle_a, triangle_b;
  for (size_t t = 0; t < b.triangles.size(); ++t) {
    ForEachNear(a, bvh_a, b, t, X_AB, [&](const TriangleCorners& of_a, const TriangleCorners& of_b) {
      const double depth = TriangleDepth(of_a, of_b);
      if (depth <= deepest.depth_m) return;
      deepest.depth_m = depth;
      triangle_a = of_a;
      triangle_b = of_b;
    });
  }
  if (deepest.depth_m < 0.0) return deepest;
  const Plane plane_a(triangle_a), plane_b(triangle_b);
  Vector3d of_a = triangle_a[0], of_b = triangle_b[0];
  const double b_behind_a = DepthBehind(triangle_a, plane_a, triangle_b, &of_b);
  const double a_behind_b = DepthBehind(triangle_b, plane_b, triangle_a, &of_a);
  if (b_behind_a <= a_behind_b) {
    deepest.point_b = of_b;
    deepest.point_a = of_b + deepest.depth_m * plane_a.normal;
  } else {
    deepest.point_a = of_a;
    deepest.point_b = of_a + deepest.depth_m * plane_b.normal;
  }
  return deepest;
}

namespace {

/// A mesh with the coordinates and indices that ODE refers to.
struct Mesh {
  explicit Mesh(TriangleMesh mesh) : triangles(std::move(mesh)) {}

  const TriangleBvh& bvh() const {
    if (!tree) tree.emplace(triangles);
    return *tree;
  }

  TriangleMesh triangles;
  mutable std::optional<TriangleBvh> tree;  ///< made when it is first needed, like `geom`
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  std::vector<dReal> coordinates;
  std::vector<dTriIndex> indices;
  dTriMeshDataID data = nullptr;
  dGeomID geom = nullptr;
};

constexpr int kCoordinatesPerVertex = 3;

void MoveGeom(const Mesh& mesh) {
  const Eigen::Matrix3d& r = mesh.pose.linear();
  const Eigen::Vector3d& p = mesh.pose.translation();
  const dMatrix3 rotation = {r(0, 0), r(0, 1), r(0, 2), 0, r(1, 0), r(1, 1), r(1, 2), 0, r(2, 0), r(2, 1), r(2, 2), 0};
  dGeomSetRotation(mesh.geom, rotation);
  dGeomSetPosition(mesh.geom, p.x(), p.y(), p.z());
}

/// Gives a mesh to ODE, at its present pose.
void MakeGeom(Mesh& entry) {
  const TriangleMesh& mesh = entry.triangles;
  entry.coordinates.reserve(kCoordinatesPerVertex * mesh.vertices.size());
  for (const Eigen::Vector3d& v : mesh.vertices)
    entry.coordinates.insert(entry.coordinates.end(), {v.x(), v.y(), v.z()});
  for (const auto& t : mesh.triangles) {
    for (int corner : t) entry.indices.push_back(static_cast<dTriIndex>(corner));
  }
  entry.data = dGeomTriMeshDataCreate();
  dGeomTriMeshDataBuildDouble(entry.data, entry.coordinates.data(), kCoordinatesPerVertex * sizeof(dReal),
                              static_cast<int>(mesh.vertices.size()), entry.indices.data(),
                              static_cast<int>(entry.indices.size()), 3 * sizeof(dTriIndex));
  entry.geom = dCreateTriMesh(nullptr, entry.data, nullptr, nullptr, nullptr);
  MoveGeom(entry);
}

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
      if (mesh->geom == nullptr) continue;
      dGeomDestroy(mesh->geom);
      dGeomTriMeshDataDestroy(mesh->data);
    }
  }
  const Mesh& at(int mesh) const { return *meshes[static_cast<size_t>(mesh)]; }
  dGeomID geom(int mesh) {
    Mesh& entry = *meshes[static_cast<size_t>(mesh)];
    if (entry.geom == nullptr) MakeGeom(entry);
    return entry.geom;
  }

  /// Returns false for a single triangle: ODE's tree for it is a null pointer that its collider dereferences.
  bool IsSupportedByOde(int mesh) const { return at(mesh).triangles.triangles.size() > 1; }

  /// Collides two meshes and returns the number of contacts, at most kOriginalContacts, which are stored in `contacts`.
  /// Empty if ODE cannot answer, because a mesh is not known to it or an assertion failed. Its contact table has four
  /// places per bucket; removing a contact that did not fit fails an assertion.
  std::optional<int> Collide(int mesh_a, int mesh_b) {
    if (!IsSupportedByOde(mesh_a) || !IsSupportedByOde(mesh_b)) return std::nullopt;
    UseOdeOnThisThread();
    const dGeomID a = geom(mesh_a), b = geom(mesh_b);
    const std::scoped_lock lock(ColliderCache());
    try {
      return dCollide(a, b, kOriginalContacts, contacts.data(), sizeof(dContactGeom));
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
  impl_->meshes.push_back(std::make_unique<Mesh>(std::move(triangles)));
  return static_cast<int>(impl_->meshes.size()) - 1;
}

void TrimeshWorld::SetPose(int mesh, const Eigen::Isometry3d& pose) {
  Mesh& entry = *impl_->meshes[static_cast<size_t>(mesh)];
  entry.pose = pose;
  if (entry.geom != nullptr) MoveGeom(entry);
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
  return MeshDepth(large.triangles, large.bvh(), small.triangles, small.bvh(),
                   large.pose.inverse(Eigen::Isometry) * small.pose);
}

std::int64_t TrimeshWorld::ode_failures() const { return impl_->ode_failures; }

MeshCrossing TrimeshWorld::Crossing(int mesh_a, int mesh_b) const {
  const Mesh &a = impl_->at(mesh_a), &b = impl_->at(mesh_b);
  MeshCrossing crossing = DeepestCrossing(a.triangles, a.bvh(), b.triangles, a.pose.inverse(Eigen::Isometry) * b.pose);
  crossing.point_a = a.pose * crossing.point_a;
  crossing.point_b = a.pose * crossing.point_b;
  return crossing;
}

const TriangleMesh& TrimeshWorld::triangles(int mesh) const { return impl_->at(mesh).triangles; }
const TriangleBvh& TrimeshWorld::bvh(int mesh) const { return impl_->at(mesh).bvh(); }

}  // namespace legopt

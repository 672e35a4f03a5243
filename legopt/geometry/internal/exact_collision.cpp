#include "legopt/geometry/internal/exact_collision.h"

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

#include "legopt/geometry/internal/link_trimeshes.h"
#include "legopt/geometry/internal/mesh_bodies.h"
#include "legopt/geometry/internal/signed_distance.h"
#include "legopt/geometry/internal/triangle_bvh.h"
#include "legopt/geometry/internal/trimesh_world.h"

namespace legopt {
namespace {

/// One scene object: its mesh in ODE, and its triangles for culling.
struct SceneMesh {
  int mesh;
  const TriangleMesh& triangles;
  const TriangleBvh& bvh;
  ClosedBodies bodies;

  /// Returns true if a triangle comes within the safety distance of the geometry's hull.
  bool Near(const LinkTrimeshes::Geometry& geometry) const {
    Eigen::AlignedBox3d box = geometry.bounds;
    box.min().array() -= LinkTrimeshes::kSafety;
    box.max().array() += LinkTrimeshes::kSafety;
    return bvh.AnyOverlapping(box, [&](int t) {
      double coordinates[3][SupportSet::kLanes];
      SupportSet set;
      for (int k = 0; k < SupportSet::kLanes; ++k) {
        const int corner = triangles.triangles[static_cast<size_t>(t)][static_cast<size_t>(k % 3)];
        const Eigen::Vector3d& p = triangles.vertices[static_cast<size_t>(corner)];
        for (int axis = 0; axis < 3; ++axis) coordinates[axis][k] = p[axis];
        if (k < 3) set.centre += p / 3.0;
      }
      set.x = coordinates[0];
      set.y = coordinates[1];
      set.z = coordinates[2];
      set.count = SupportSet::kLanes;
      PairDistance distance;
      return SignedDistance(geometry.placed, set, LinkTrimeshes::kSafety, distance);
    });
  }

  /// Returns the depth of the geometry's deepest vertex inside the object's bodies; 0 if there is none. If no triangle
  /// is near, either all or no vertices are inside.
  double DepthOf(const LinkTrimeshes::Geometry& geometry, const std::vector<Eigen::Vector3d>& vertices,
                 bool near) const {
    double deepest = 0.0;
    for (const Eigen::Vector3d& vertex : vertices) {
      deepest = std::max(deepest, bodies.Depth(geometry.pose * vertex));
      if (!near && deepest == 0.0) break;
    }
    return deepest;
  }

  /// Returns the depth of the deepest vertex of the object's bodies inside those of a nearby geometry.
  double DepthIn(const LinkTrimeshes::Geometry& geometry, Culling culling) const {
    const Eigen::Isometry3d X_GW = geometry.pose.inverse(Eigen::Isometry);
    double deepest = 0.0;
    for (const ClosedBodies::Body& body : bodies.bodies()) {
      if (culling == Culling::kOn && !body.bounds.intersects(geometry.bounds)) continue;
      for (const Eigen::Vector3d& vertex : bodies.vertices(body)) {
        if (culling == Culling::kOn && !geometry.bounds.contains(vertex)) continue;
        deepest = std::max(deepest, geometry.bodies->Depth(X_GW * vertex));
      }
    }
    return deepest;
  }
};

/// Returns the pairs of `all` that are not in `some`; both are sorted in the same order.
std::vector<LinkPair> Without(const std::vector<LinkPair>& some, const std::vector<LinkPair>& all) {
  const auto before = [](const LinkPair& a, const LinkPair& b) {
    return std::pair(a.second, a.first) < std::pair(b.second, b.first);
  };
  std::vector<LinkPair> rest;
  std::ranges::set_difference(all, some, std::back_inserter(rest), before);
  return rest;
}

}  // namespace

struct ExactCollision::Impl {
  Impl(const RobotModel& robot, const Scene& scene, std::shared_ptr<const CollisionModel> collision_model,
       Culling with_culling)
      : model(std::move(collision_model)),
        ignored(Without(model->pairs(PairSelection::kReference), model->pairs(PairSelection::kAll))),
        culling(with_culling),
        num_links(static_cast<int>(robot.links().size())),
        links(robot, world, culling) {
    for (const SceneObject& object : scene.objects) {
      TriangleMesh mesh = Tessellate(object.shape, scene.read_guard);
      ClosedBodies bodies(mesh);
      const int number = world.Add(std::move(mesh));
      objects.push_back({number, world.triangles(number), world.bvh(number), std::move(bodies)});
    }
  }

  bool Near(const LinkTrimeshes::Geometry& geometry, const SceneMesh& object) const {
    return culling == Culling::kOff || object.Near(geometry);
  }

  /// Calls action(geometry of a, geometry of b), from the last to the first.
  template <class Action>
  void ForEachGeometryPair(const LinkPair& pair, Action action) const {
    for (int a = links.num_geometries(pair.first) - 1; a >= 0; --a) {
      for (int b = links.num_geometries(pair.second) - 1; b >= 0; --b) {
        action(links.geometry(pair.first, a), links.geometry(pair.second, b));
      }
    }
  }

  /// Calls action(geometry, scene object, its index).
  template <class Action>
  void ForEachGeometryAndObject(Action action) const {
    for (int link = 0; link < num_links; ++link) {
      for (int g = 0; g < links.num_geometries(link); ++g) {
        for (size_t object = 0; object < objects.size(); ++object) {
          action(links.geometry(link, g), objects[object], static_cast<int>(object));
        }
      }
    }
  }

  std::shared_ptr<const CollisionModel> model;
  std::vector<LinkPair> ignored;  ///< pairs of the solid rule that the original evaluator ignores
  Culling culling;
  int num_links;
  TrimeshWorld world;
  LinkTrimeshes links;
  std::vector<SceneMesh> objects;
};

ExactCollision::ExactCollision(const RobotModel& robot, const Scene& scene, std::shared_ptr<const CollisionModel> model,
                               Culling culling)
    : impl_(std::make_unique<Impl>(robot, scene, std::move(model), culling)) {}
ExactCollision::~ExactCollision() = default;
ExactCollision::ExactCollision(ExactCollision&&) noexcept = default;
ExactCollision& ExactCollision::operator=(ExactCollision&&) noexcept = default;

double ExactCollision::EnvironmentDepth(const Kinematics& kinematics) {
  return DeepestEnvironmentContacts(kinematics).strict.depth_m;
}

ExactCollision::SceneContacts ExactCollision::DeepestEnvironmentContacts(const Kinematics& kinematics) {
  impl_->links.Place(kinematics);
  SceneContacts result;
  const auto include = [](const SceneContact& contact, SceneContact* deepest) {
    if (contact.depth_m < 0.0 || (deepest->link >= 0 && contact.depth_m <= deepest->depth_m)) return;
    *deepest = contact;
  };
  impl_->ForEachGeometryAndObject([&](const auto& geometry, const SceneMesh& object, int index) {
    if (!impl_->Near(geometry, object)) return;
    const TrimeshWorld::Depths depths = impl_->world.AllDepths(geometry.mesh, object.mesh);
    include({depths.original_m, geometry.link, index}, &result.literal);
    include({depths.all_m, geometry.link, index}, &result.strict);
  });
  return result;
}

ExactCollision::SelfDepths ExactCollision::SelfDepth(const Kinematics& kinematics) {
  impl_->links.Place(kinematics);
  SelfDepths result;
  for (const LinkPair& pair : impl_->model->pairs(PairSelection::kReference)) {
    bool first = true;
    impl_->ForEachGeometryPair(pair, [&](const auto& a, const auto& b) {
      const TrimeshWorld::Depths depths = impl_->links.AllDepths(a, b);
      if (depths.original_m < 0.0) return;
      if (first) {
        result.literal_m = depths.original_m;
        result.literal_pair = pair;
        first = false;
      }
      if (result.strict_pair.first < 0 || depths.all_m > result.strict_m) {
        result.strict_m = depths.all_m;
        result.strict_pair = pair;
      }
    });
  }
  return result;
}

ExactCollision::LinkContact ExactCollision::DeepestIgnoredContact(const Kinematics& kinematics) {
  impl_->links.Place(kinematics);
  LinkContact deepest;
  for (const LinkPair& pair : impl_->ignored) {
    impl_->ForEachGeometryPair(pair, [&](const auto& a, const auto& b) {
      const double depth_m = impl_->links.ExactDepth(a, b);
      if (depth_m > deepest.depth_m) deepest = {depth_m, pair};
    });
  }
  return deepest;
}

ExactCollision::Containment ExactCollision::DeepestContainment(const Kinematics& kinematics) {
  impl_->links.Place(kinematics);
  Containment deepest;
  impl_->ForEachGeometryAndObject([&](const auto& geometry, const SceneMesh& object, int index) {
    const bool near = impl_->Near(geometry, object);
    double depth_m = object.DepthOf(geometry, impl_->links.vertices(geometry), near);
    if (near) depth_m = std::max(depth_m, object.DepthIn(geometry, impl_->culling));
    if (depth_m > deepest.depth_m) deepest = {.depth_m = depth_m, .link = geometry.link, .object = index};
  });
  for (const LinkPair& pair : impl_->model->pairs(PairSelection::kAll)) {
    impl_->ForEachGeometryPair(pair, [&](const auto& a, const auto& b) {
      const double depth_m = impl_->links.InsideDepth(a, b);
      if (depth_m > deepest.depth_m) deepest = {.depth_m = depth_m, .link = a.link, .other_link = b.link};
    });
  }
  return deepest;
}

namespace {

/// Updates an overlap by the depths of two geometries; `place` computes where their surfaces cross.
template <class Place>
void IncludeDepths(const TrimeshWorld::Depths& depths, double inside_m, Place place, ExactCollision::Overlap* overlap) {
  overlap->literal_m = std::max(overlap->literal_m, depths.original_m);
  overlap->inside_m = std::max(overlap->inside_m, inside_m);
  if (depths.all_m < 0.0 || depths.all_m <= overlap->depth_m) return;
  overlap->depth_m = depths.all_m;
  const MeshCrossing crossing = place();
  if (crossing.depth_m < 0.0) return;  // ODE finds crossing triangles in single precision and may disagree
  overlap->point_W = crossing.point_a;
  overlap->other_point_W = crossing.point_b;
}

bool IsOverlap(const ExactCollision::Overlap& overlap) { return overlap.depth_m >= 0.0 || overlap.inside_m > 0.0; }

}  // namespace

std::vector<ExactCollision::Overlap> ExactCollision::Overlaps(const Kinematics& kinematics) {
  impl_->links.Place(kinematics);
  std::vector<Overlap> found;
  for (int link = 0; link < impl_->num_links; ++link) {
    for (size_t object = 0; object < impl_->objects.size(); ++object) {
      Overlap overlap{.link = link, .object = static_cast<int>(object)};
      const SceneMesh& mesh = impl_->objects[object];
      for (int g = 0; g < impl_->links.num_geometries(link); ++g) {
        const auto& geometry = impl_->links.geometry(link, g);
        const bool near = impl_->Near(geometry, mesh);
        double inside_m = mesh.DepthOf(geometry, impl_->links.vertices(geometry), near);
        if (near) inside_m = std::max(inside_m, mesh.DepthIn(geometry, impl_->culling));
        const auto depths = near ? impl_->world.AllDepths(geometry.mesh, mesh.mesh) : TrimeshWorld::Depths();
        IncludeDepths(
            depths, inside_m, [&] { return impl_->world.Crossing(geometry.mesh, mesh.mesh); }, &overlap);
      }
      if (IsOverlap(overlap)) found.push_back(overlap);
    }
  }
  for (const LinkPair& pair : impl_->model->pairs(PairSelection::kAll)) {
    Overlap overlap{.link = pair.first, .other_link = pair.second};
    overlap.ignored = std::ranges::find(impl_->ignored, pair) != impl_->ignored.end();
    impl_->ForEachGeometryPair(pair, [&](const auto& a, const auto& b) {
      const double exact_m = overlap.ignored ? impl_->links.ExactDepth(a, b) : -1.0;
      const auto depths =
          overlap.ignored ? TrimeshWorld::Depths{.original_m = -1.0, .all_m = exact_m} : impl_->links.AllDepths(a, b);
      IncludeDepths(
          depths, impl_->links.InsideDepth(a, b), [&] { return impl_->world.Crossing(a.mesh, b.mesh); }, &overlap);
    });
    if (IsOverlap(overlap)) found.push_back(overlap);
  }
  return found;
}

ExactCollision::Step ExactCollision::LongestStep(const Kinematics& from, const Kinematics& to) const {
  Step longest;
  for (int link = 0; link < impl_->num_links; ++link) {
    const Eigen::Isometry3d &X_from = from.link_pose(link), &X_to = to.link_pose(link);
    for (int g = 0; g < impl_->links.num_geometries(link); ++g) {
      for (const Eigen::Vector3d& point : impl_->links.geometry(link, g).hull.points()) {
        const double distance_m = (X_to * point - X_from * point).norm();
        if (longest.link < 0 || distance_m > longest.distance_m) longest = {distance_m, link};
      }
    }
  }
  return longest;
}

void ExactCollision::AddLinkTriangles(int link, const Eigen::Isometry3d& X_FL, const Eigen::AlignedBox2d& rectangle_F,
                                      TriangleColumns* columns) const {
  for (int g = 0; g < impl_->links.num_geometries(link); ++g) {
    const TriangleMesh& mesh = impl_->world.triangles(impl_->links.geometry(link, g).mesh);
    for (int t = 0; t < std::ssize(mesh.triangles); ++t) {
      Eigen::AlignedBox2d box;
      for (const int vertex : mesh.triangles[static_cast<std::size_t>(t)]) {
        box.extend((X_FL * mesh.vertices[static_cast<std::size_t>(vertex)]).head<2>().eval());
      }
      if (box.intersects(rectangle_F)) columns->Add(mesh, t, X_FL);
    }
  }
}

void ExactCollision::AddSceneTriangles(const Eigen::Isometry3d& X_WF, const Eigen::AlignedBox3d& box_F,
                                       TriangleColumns* columns) const {
  const Eigen::AlignedBox3d box_W = box_F.transformed(X_WF);
  const Eigen::Isometry3d X_FW = X_WF.inverse(Eigen::Isometry);
  for (const SceneMesh& object : impl_->objects) {
    object.bvh.AnyOverlapping(box_W, [&](int t) {
      columns->Add(object.triangles, t, X_FW);
      return false;
    });
  }
}

std::int64_t ExactCollision::ode_failures() const { return impl_->world.ode_failures(); }

}  // namespace legopt

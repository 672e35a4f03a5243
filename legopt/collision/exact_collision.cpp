#include "legopt/collision/exact_collision.h"

#include <utility>
#include <vector>

#include "legopt/collision/link_trimeshes.h"
#include "legopt/collision/signed_distance.h"
#include "legopt/collision/triangle_bvh.h"
#include "legopt/collision/trimesh_world.h"

namespace legopt {
namespace {

/// One scene object: its mesh within ODE, and its triangles once more to find out cheaply that a link is clear of it.
struct SceneMesh {
  int mesh;
  TriangleMesh triangles;
  TriangleBvh bvh;

  /// True when some triangle comes within the safety distance of the geometry's hull.
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
};

}  // namespace

struct ExactCollision::Impl {
  Impl(const RobotModel& robot, const Scene& scene, std::shared_ptr<const CollisionModel> collision_model)
      : model(std::move(collision_model)), num_links(static_cast<int>(robot.links().size())), links(robot, world) {
    for (const SceneObject& object : scene.objects) {
      TriangleMesh mesh = Tessellate(object.shape, scene.read_guard);
      TriangleBvh bvh(mesh);
      const int number = world.Add(mesh);
      objects.push_back({number, std::move(mesh), std::move(bvh)});
    }
  }

  std::shared_ptr<const CollisionModel> model;
  int num_links;
  TrimeshWorld world;
  LinkTrimeshes links;
  std::vector<SceneMesh> objects;
};

ExactCollision::ExactCollision(const RobotModel& robot, const Scene& scene, std::shared_ptr<const CollisionModel> model)
    : impl_(std::make_unique<Impl>(robot, scene, std::move(model))) {}
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
  for (int link = 0; link < impl_->num_links; ++link) {
    for (int g = 0; g < impl_->links.num_geometries(link); ++g) {
      const LinkTrimeshes::Geometry& geometry = impl_->links.geometry(link, g);
      for (size_t object = 0; object < impl_->objects.size(); ++object) {
        if (!impl_->objects[object].Near(geometry)) continue;
        const TrimeshWorld::Depths depths = impl_->world.AllDepths(geometry.mesh, impl_->objects[object].mesh);
        include({depths.original_m, link, static_cast<int>(object)}, &result.literal);
        include({depths.all_m, link, static_cast<int>(object)}, &result.strict);
      }
    }
  }
  return result;
}

ExactCollision::SelfDepths ExactCollision::SelfDepth(const Kinematics& kinematics) {
  impl_->links.Place(kinematics);
  SelfDepths result;
  for (const LinkPair& pair : impl_->model->checked_pairs()) {
    bool first = true;
    for (int a = impl_->links.num_geometries(pair.first) - 1; a >= 0; --a) {
      for (int b = impl_->links.num_geometries(pair.second) - 1; b >= 0; --b) {
        const TrimeshWorld::Depths depths =
            impl_->links.AllDepths(impl_->links.geometry(pair.first, a), impl_->links.geometry(pair.second, b));
        if (depths.original_m < 0.0) continue;
        if (first) {
          result.literal_m = depths.original_m;
          result.literal_pair = pair;
          first = false;
        }
        if (result.strict_pair.first < 0 || depths.all_m > result.strict_m) {
          result.strict_m = depths.all_m;
          result.strict_pair = pair;
        }
      }
    }
  }
  return result;
}

}  // namespace legopt

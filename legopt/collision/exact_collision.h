#pragma once

#include <memory>

#include "legopt/collision/collision_model.h"
#include "legopt/collision/scene.h"
#include "legopt/robot/kinematics.h"

namespace legopt {

/// Collision as the original evaluator sees it: triangle meshes against triangle meshes by ODE (reference 1.5 and 6).
/// For the judge.
///
/// Depths are ODE's: only crossing surfaces count, measured against face normals; 0 = no contact. A body wholly inside
/// a closed mesh is free. Each geometry of a link and each scene object is one trimesh; primitives are tessellated
/// (inscribed). At most 255 contacts per pair of geometries, as in the original.
///
/// Thread rule: one thread at a time; make one per thread.
class ExactCollision {
 public:
  /// Loads all meshes of the robot and the scene. `model` supplies the ignored link pairs.
  /// Throws InputError when a mesh cannot be loaded.
  ExactCollision(const RobotModel& robot, const Scene& scene, std::shared_ptr<const CollisionModel> model);
  ~ExactCollision();
  ExactCollision(ExactCollision&&) noexcept;
  ExactCollision& operator=(ExactCollision&&) noexcept;

  struct EnvironmentDepthResult {
    double depth_m = 0.0;  ///< largest depth of all contacts of all links
    int link = -1;         ///< the link that has it; -1 when there is no contact
    int object = -1;       ///< index in Scene::objects
  };
  /// Largest contact depth between any link and any scene object, >= 0.
  double EnvironmentDepth(const Kinematics& kinematics);
  /// The same with the link and object that have it.
  EnvironmentDepthResult DeepestEnvironmentContact(const Kinematics& kinematics);

  struct SelfDepths {
    double literal_m =
        0.0;  ///< depth of the colliding pair that comes last (reference 1.5, item 6); 0 when none collides
    double strict_m = 0.0;          ///< largest depth of all colliding pairs and all their contacts
    LinkPair literal_pair{-1, -1};  ///< (first < second); -1 when none
    LinkPair strict_pair{-1, -1};
  };
  /// Checked link pairs in ascending order of (higher, lower) link index; within a pair the geometries from the last to
  /// the first.
  SelfDepths SelfDepth(const Kinematics& kinematics);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace legopt

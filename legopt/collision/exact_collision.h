#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "legopt/collision/collision_model.h"
#include "legopt/collision/culling.h"
#include "legopt/collision/scene.h"
#include "legopt/robot/kinematics.h"

namespace legopt {

/// Collision as the original evaluator sees it: triangle meshes against triangle meshes by ODE. For the judge; see
/// docs/readings.md#contact-depth.
///
/// Contact depths are ODE's: only crossing surfaces count, measured against face normals; 0 = no contact. A body wholly
/// inside a closed mesh is free of contacts; Containment finds it. Each geometry of a link and each scene object is one
/// trimesh; primitives are tessellated (inscribed).
///
/// *Literal* figures (docs/readings.md#literal-and-strict-rule) look at the first 255 contacts per pair of geometries,
/// *strict* ones at all: where there are so many, at all crossing triangles by the same rule (triangle_depth.h), and so
/// do *solid* ones throughout. ODE merges contacts that fall into one cell of 0.1 mm, which may lower a depth
/// by up to 0.01 mm, and finds crossing triangles in single precision: where a depth jumps as another pair of triangles
/// starts to touch, and at slivers less than a micrometre high, the last micrometres decide.
///
/// Thread rule: one thread at a time; make one per thread.
class ExactCollision {
 public:
  /// A point that there is not.
  static inline const Eigen::Vector3d kNowhere = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());

  /// Loads all meshes of the robot and the scene. `model` supplies the link pairs of both selections.
  /// Throws InputError when a mesh cannot be loaded.
  ExactCollision(const RobotModel& robot, const Scene& scene, std::shared_ptr<const CollisionModel> model,
                 Culling culling = Culling::kOn);
  ~ExactCollision();
  /// What is moved from may only be destroyed or assigned to.
  ExactCollision(ExactCollision&&) noexcept;
  /// Likewise.
  ExactCollision& operator=(ExactCollision&&) noexcept;

  /// The deepest contact of any link with the scene.
  struct SceneContact {
    double depth_m = 0.0;  ///< >= 0
    int link = -1;         ///< -1 when there is no contact
    int object = -1;       ///< index in Scene::objects
  };
  /// The deepest contacts by literal and strict rule.
  struct SceneContacts {
    SceneContact literal;  ///< as the original evaluator sees them
    SceneContact strict;   ///< at least as deep
  };
  /// In one configuration; see SceneContacts.
  SceneContacts DeepestEnvironmentContacts(const Kinematics& kinematics);
  /// Largest contact depth between any link and any scene object, all contacts counted, >= 0.
  double EnvironmentDepth(const Kinematics& kinematics);

  /// Of the robot with itself, in one configuration.
  struct SelfDepths {
    double literal_m = 0.0;         ///< depth of the colliding pair that comes last; 0 when none collides
    double strict_m = 0.0;          ///< largest depth of all colliding pairs and all their contacts
    LinkPair literal_pair{-1, -1};  ///< (first < second); -1 when none
    LinkPair strict_pair{-1, -1};   ///< with strict_m; -1 when none
  };
  /// Pairs of PairSelection::kReference in ascending order of (higher, lower) link index; within a pair the geometries
  /// from the last to the first.
  SelfDepths SelfDepth(const Kinematics& kinematics);

  /// Two links in each other.
  struct LinkContact {
    double depth_m = 0.0;   ///< >= 0
    LinkPair pair{-1, -1};  ///< (first < second); -1 when there is no contact
  };
  /// The deepest contact, of all that there are, of the pairs that PairSelection::kAll has beyond kReference.
  LinkContact DeepestIgnoredContact(const Kinematics& kinematics);

  /// A vertex of one inside of a closed body (closed_bodies.h) of the other: of a link and the scene, or of two links.
  struct Containment {
    double depth_m = 0.0;  ///< of the vertex below the surface, >= 0
    int link = -1;         ///< -1: nothing is inside of anything
    int other_link = -1;   ///< of a pair of PairSelection::kAll; -1: `object` is it
    int object = -1;       ///< index in Scene::objects; -1: `other_link` is it
  };
  /// The deepest one in one configuration. Looks both for links in bodies and for bodies in links.
  Containment DeepestContainment(const Kinematics& kinematics);

  /// Two things in each other, in one configuration.
  struct Overlap {
    int link = -1;         ///< of a robot
    int other_link = -1;   ///< > link; -1: `object` is it
    int object = -1;       ///< index in Scene::objects; -1: `other_link` is it
    bool ignored = false;  ///< a pair of PairSelection::kAll that kReference has not: only the solid rule looks at it
    double literal_m = -1.0;  ///< largest contact depth as the original evaluator has it; negative: surfaces apart
    double depth_m = -1.0;    ///< of all contacts; negative: surfaces apart
    double inside_m = 0.0;    ///< of the deepest vertex of one inside of a closed body of the other, >= 0
    /// Where the surfaces cross most deeply, on the link, in the world; NaN where they are apart.
    Eigen::Vector3d point_W = kNowhere;
    Eigen::Vector3d other_point_W = kNowhere;  ///< likewise on the other
  };
  /// All of them, scene first, then pairs of links by (higher, lower) index; of a pair of things with several
  /// geometries the deepest figures of all.
  std::vector<Overlap> Overlaps(const Kinematics& kinematics);

  /// How far points of a link move.
  struct Step {
    double distance_m = 0.0;  ///< along a straight line, >= 0
    int link = -1;            ///< -1: the robot has no geometry
  };
  /// The farthest any point of any link's geometry is from where it was: at a vertex of its hull, as the distance is a
  /// convex function of the point.
  Step LongestStep(const Kinematics& from, const Kinematics& to) const;

  /// Number of mesh queries since construction in which ODE failed an assertion and the exact triangle test answered
  /// (TrimeshWorld::ode_failures).
  std::int64_t ode_failures() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace legopt

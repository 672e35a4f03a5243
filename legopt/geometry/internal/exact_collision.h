#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "legopt/geometry/collision_model.h"
#include "legopt/geometry/internal/triangle_columns.h"
#include "legopt/geometry/scene.h"
#include "legopt/robot/kinematics.h"

namespace legopt {

/// Switch for culling with hulls, bounds and distances before exact meshes are compared. It affects only the time, not
/// the results (docs/explanation/judge.md#what-judge-and-solver-share); off for audits of this property.
enum class Culling {
  kOn,  ///< default
  kOff  ///< compares every pair of meshes and every vertex
};

/// Collision checks of the original evaluator, for the judge: ODE contacts between triangle meshes; see
/// docs/explanation/judge.md#contact-depth.
///
/// Contact depths are ODE's: only crossing surfaces count, measured against face normals; 0 = no contact. A body
/// completely inside a closed mesh has no contacts; Containment detects it. Each geometry of a link and each scene
/// object is one trimesh; primitives are tessellated (inscribed).
///
/// *Literal* depths (the original evaluator's rule, docs/explanation/judge.md#literal-and-strict-rule) use the first
/// 255 contacts per pair of geometries. *Strict* depths use all contacts: if there are more than 255, all crossing
/// triangles by the same rule (trimesh_world.h). *Solid* depths (solid rule) always use all crossing triangles. ODE
/// merges contacts within a cell of 0.1 mm, which may lower a depth by up to 0.01 mm, and finds crossing triangles in
/// single precision. Depths are therefore uncertain by micrometres where they jump because another pair of triangles
/// starts to touch, and at slivers less than a micrometre high.
///
/// Not thread-safe; create one per thread.
class ExactCollision {
 public:
  /// Undefined point.
  static inline const Eigen::Vector3d kNowhere = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());

  /// Loads all meshes of the robot and the scene. `model` provides the link pairs of both selections. Throws InputError
  /// if a mesh cannot be loaded.
  ExactCollision(const RobotModel& robot, const Scene& scene, std::shared_ptr<const CollisionModel> model,
                 Culling culling = Culling::kOn);
  ~ExactCollision();
  /// A moved-from object may only be destroyed or assigned to.
  ExactCollision(ExactCollision&&) noexcept;
  ExactCollision& operator=(ExactCollision&&) noexcept;

  /// The deepest contact of any link with the scene.
  struct SceneContact {
    double depth_m = 0.0;  ///< >= 0
    int link = -1;         ///< -1 if there is no contact
    int object = -1;       ///< index into Scene::objects
  };
  /// The deepest contacts by the literal and the strict rule.
  struct SceneContacts {
    SceneContact literal;  ///< original evaluator's rule
    SceneContact strict;   ///< every listed pair; not less deep
  };
  /// Computes the deepest scene contacts at one configuration.
  SceneContacts DeepestEnvironmentContacts(const Kinematics& kinematics);
  /// Returns the largest contact depth between any link and any scene object, over all contacts, >= 0.
  double EnvironmentDepth(const Kinematics& kinematics);

  /// Self-collision depths at one configuration.
  struct SelfDepths {
    double literal_m = 0.0;         ///< depth of the last colliding pair; 0 if there is none
    double strict_m = 0.0;          ///< largest depth over all colliding pairs and all contacts
    LinkPair literal_pair{-1, -1};  ///< (first < second); -1 if there is none
    LinkPair strict_pair{-1, -1};   ///< pair with depth strict_m; -1 if there is none
  };
  /// Computes the self-collision depths of the pairs of PairSelection::kReference, in ascending order of (higher,
  /// lower) link index; within a pair the geometries from the last to the first.
  SelfDepths SelfDepth(const Kinematics& kinematics);

  /// Contact of two links.
  struct LinkContact {
    double depth_m = 0.0;   ///< >= 0
    LinkPair pair{-1, -1};  ///< (first < second); -1 if there is no contact
  };
  /// Returns the deepest of all contacts of the pairs in PairSelection::kAll but not in kReference.
  LinkContact DeepestIgnoredContact(const Kinematics& kinematics);

  /// A vertex inside a closed body (mesh_bodies.h): of a link and the scene, or of two links.
  struct Containment {
    double depth_m = 0.0;  ///< depth of the vertex below the surface, >= 0
    int link = -1;         ///< -1: no containment
    int other_link = -1;   ///< other link of a pair in PairSelection::kAll; -1: the other one is `object`
    int object = -1;       ///< index into Scene::objects; -1: the other one is `other_link`
  };
  /// Returns the deepest containment at one configuration: links inside bodies, and bodies inside links.
  Containment DeepestContainment(const Kinematics& kinematics);

  /// Overlap of two links, or of a link and an object, at one configuration.
  struct Overlap {
    int link = -1;
    int other_link = -1;      ///< > link; -1: the other one is `object`
    int object = -1;          ///< index into Scene::objects; -1: the other one is `other_link`
    bool ignored = false;     ///< pair in PairSelection::kAll but not in kReference: only the solid rule checks it
    double literal_m = -1.0;  ///< largest contact depth by the original evaluator's rule; negative: surfaces are
                              ///< separate
    double depth_m = -1.0;    ///< largest depth of all contacts; negative: surfaces are separate
    double inside_m = 0.0;    ///< depth of the deepest vertex of one inside a closed body of the other, >= 0
    /// Deepest crossing point of the surfaces, on the link, in the world; NaN if they are separate.
    Eigen::Vector3d point_W = kNowhere;
    Eigen::Vector3d other_point_W = kNowhere;  ///< deepest crossing point on the other one
  };
  /// Returns all overlaps, first with the scene, then link pairs by (higher, lower) index. If a link has several
  /// geometries, its depths are the maxima.
  std::vector<Overlap> Overlaps(const Kinematics& kinematics);

  /// Movement of the points of a link.
  struct Step {
    double distance_m = 0.0;  ///< straight-line distance, >= 0
    int link = -1;            ///< -1: the robot has no geometry
  };
  /// Returns the maximum distance that any point of any link's geometry moves between two configurations. It occurs at
  /// a hull vertex, since the distance is a convex function of the point.
  Step LongestStep(const Kinematics& from, const Kinematics& to) const;

  /// Adds the triangles of a link over a rectangle of a frame F to `columns`. `X_FL`: link frame in F.
  void AddLinkTriangles(int link, const Eigen::Isometry3d& X_FL, const Eigen::AlignedBox2d& rectangle_F,
                        TriangleColumns* columns) const;
  /// Adds all triangles of the scene that come near a box in a frame F. `X_WF`: F in the world.
  void AddSceneTriangles(const Eigen::Isometry3d& X_WF, const Eigen::AlignedBox3d& box_F,
                         TriangleColumns* columns) const;

  /// Number of mesh queries since construction in which ODE failed an assertion and the exact triangle test was used
  /// instead (TrimeshWorld::ode_failures).
  std::int64_t ode_failures() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace legopt

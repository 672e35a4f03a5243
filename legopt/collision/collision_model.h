#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <utility>
#include <vector>

#include "legopt/collision/mesh.h"
#include "legopt/collision/scene.h"
#include "legopt/robot/robot_model.h"
#include "words/collision.h"

namespace legopt {

/// Two robot links, first < second.
using LinkPair = std::pair<int, int>;

/// How shapes are turned into convex obstacles. Lengths in metres. Validated by CollisionModel::Build (InputError).
struct CollisionOptions {
  /// Links whose hull forbids what is free (decomposed_pairs) are cut until their convex pieces stand off from the mesh
  /// by at most this much, or until `max_link_pieces` is reached. Smaller: more pieces, slower, fewer phantom contacts.
  /// > 0.
  double link_concavity_m = 0.03;
  /// Upper bound of convex pieces per link mesh, 1..64. 1 = hulls only (the paper's choice).
  int max_link_pieces = 8;
  /// The same two for components of the scene that are neither convex nor vertical prisms.
  double scene_concavity_m = 0.03;
  int max_component_pieces = 24;  ///< upper bound per component, 1..64
  /// What the scene is made of; the robot's side does not depend on it.
  SceneRepresentation scene = SceneRepresentation::kSolid;
  /// Which pairs of links are compared.
  PairSelection pairs = PairSelection::kReference;
};

/// Convex shapes of a robot and of a scene, and the rule which link pairs are compared. What the solver collides.
///
/// Robot: every geometry of a link becomes its primitive or its convex hull. Pairs of links whose hulls overlap in many
/// postures in which the meshes are apart are compared by finer convex pieces that together cover the meshes. Scene of
/// solids: primitives stay primitives; a mesh is split into connected components, convex ones become one solid,
/// vertical prisms are cut into convex prisms between their real top and bottom surfaces, others are decomposed
/// approximately. Scene as a surface: primitives are tessellated, every triangle is a flat convex shape. No triangle
/// mesh is kept as such: a convex shape never meets an ODE triangle mesh (ODE would report nothing).
///
/// Checked link pairs (docs/readings.md#ignored-link-pairs): both links have geometry, more than one moving joint lies
/// between them, and
/// * PairSelection::kReference: their exact triangle meshes do not intersect at `reference_x`;
/// * PairSelection::kAll: some posture parts them, of a fixed sequence: `reference_x`, upright, and 255 that are
/// uniform
///   within the joint limits. Parted: not more than 1 mm in each other, by contact or by a vertex inside a closed mesh.
///
/// Immutable; const members are safe from any number of threads.
class CollisionModel {
 public:
  /// Whether a pair of links is compared, and if not, why.
  enum class PairStatus {
    kChecked,               ///< compared
    kIgnoredAdjacent,       ///< at most one moving joint between them, or a link without geometry
    kIgnoredReferencePose,  ///< their meshes intersect at `reference_x`; not of PairSelection::kAll
    kIgnoredJoined          ///< no posture parts them; of PairSelection::kAll only
  };

  /// `reference_x`: configuration (n + 7) whose touching link pairs are ignored for good.
  /// Throws InputError: a mesh that cannot be loaded, a degenerate shape, wrong size of `reference_x`, bad options.
  static std::shared_ptr<const CollisionModel> Build(const RobotModel& robot, const Scene& scene,
                                                     Eigen::Ref<const Eigen::VectorXd> reference_x,
                                                     const CollisionOptions& options = {});

  ~CollisionModel();
  CollisionModel(const CollisionModel&) = delete;
  CollisionModel& operator=(const CollisionModel&) = delete;

  int num_links() const;  ///< of the robot
  /// Pairs of links that are compared, ascending by (second, first), the order of the original evaluator.
  const std::vector<LinkPair>& checked_pairs() const;
  /// Pairs of another selection than that of the model, in the same order.
  const std::vector<LinkPair>& pairs(PairSelection selection) const;
  /// Status of any two different links, in any order. A link without geometry is adjacent to all.
  PairStatus pair_status(int a, int b) const;
  /// Checked pairs that are compared by finer pieces, in the order of checked_pairs().
  const std::vector<LinkPair>& decomposed_pairs() const;
  /// Convex shapes of a link, one per geometry; 0 when it has none.
  int num_link_pieces(int link) const;
  /// A ball in the link's frame, m. Radius < 0 for links without geometry.
  struct Ball {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< link frame
    double radius = -1.0;                              ///< m; < 0: the link has no geometry
  };
  /// Holds all shapes of the link.
  const Ball& link_ball(int link) const;

  SceneRepresentation scene_representation() const;  ///< what num_scene_solids() counts: solids or triangles
  /// Convex obstacles of the scene: solids or triangles.
  int num_scene_solids() const;

  /// True when the world point lies inside of a scene solid by more than `depth_m` [m]. Exact for hulls and primitives.
  /// A surface contains nothing. Slow (tests, tools).
  bool SceneContains(const Eigen::Vector3d& point_W, double depth_m = 0.0) const;

  struct Impl;                                 // internal: defined in model_data.h
  const Impl& impl() const { return *impl_; }  ///< internal to the room

 private:
  explicit CollisionModel(std::unique_ptr<const Impl> impl);
  std::unique_ptr<const Impl> impl_;
};

/// No point of the ball moves farther between two poses of its link, m, as the crow flies.
double LargestWay(const CollisionModel::Ball& ball, const Eigen::Isometry3d& a, const Eigen::Isometry3d& b);

}  // namespace legopt

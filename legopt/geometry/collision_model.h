#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "legopt/geometry/internal/mesh.h"
#include "legopt/geometry/scene.h"
#include "legopt/robot/robot_model.h"
#include "legopt/types/collision.h"

namespace legopt {

/// Two robot links, first < second.
using LinkPair = std::pair<int, int>;

/// A pair of links that is not compared.
struct UncheckedPair {
  LinkPair pair;                                        ///< first < second
  UncheckedReason reason = UncheckedReason::kAdjacent;  ///< only kNever is compared by PairSelection::kAll
};

/// Conversion of shapes into convex obstacles. Lengths in metres. CollisionModel::Build validates it (InputError).
struct CollisionOptions {
  /// Tolerance for decomposing links whose hulls overlap although their meshes do not (decomposed_pairs): decomposition
  /// stops when no convex piece deviates from the mesh by more than this, or when `max_link_pieces` is reached. Smaller
  /// values give more pieces, slower queries and fewer false contacts. > 0.
  double link_concavity_m = 0.03;
  /// Maximum number of convex pieces per link mesh, 1..64. 1 = hulls only (the paper's choice).
  int max_link_pieces = 8;
  /// Same tolerance for components of the scene that are neither convex nor vertical prisms.
  double scene_concavity_m = 0.03;
  int max_component_pieces = 24;  ///< maximum number of convex pieces per component, 1..64
  /// Representation of the scene; does not affect the robot.
  SceneRepresentation scene = SceneRepresentation::kSolid;
  /// Pairs of links to be checked.
  PairSelection pairs = PairSelection::kReference;
  /// Pairs that are not compared, without duplicates; all other pairs of links with geometry are. Empty: the rules of
  /// `reference_x` (CollisionModel).
  std::optional<std::vector<UncheckedPair>> unchecked = std::nullopt;
  /// Shapes of link meshes against a scene of solids.
  LinkRepresentation links = LinkRepresentation::kHulls;
};

/// Convex shapes of a robot and a scene, and the link pairs to be checked: the solver's collision model.
///
/// Robot: every geometry of a link becomes a primitive or a convex hull. Link pairs whose hulls overlap in many
/// postures in which the meshes do not are checked with finer convex pieces that together cover the meshes. Scene of
/// solids: primitives stay primitives. A mesh is split into connected components: convex ones become one solid,
/// vertical prisms are cut into convex prisms between their actual top and bottom surfaces, others are decomposed
/// approximately. Scene as a surface: primitives are tessellated, and every triangle is a flat convex shape. The model
/// contains no triangle meshes: ODE reports no contacts between a custom convex shape and a triangle mesh.
///
/// Checked link pairs (docs/explanation/judge.md#ignored-link-pairs): both links have geometry, more than one moving
/// joint lies between them, and
/// * PairSelection::kReference: their exact triangle meshes do not intersect at `reference_x`;
/// * PairSelection::kAll: they are separated in at least one posture of a fixed sequence: `reference_x`, upright, and
///   255 postures uniform within the joint limits. Separated: overlapping by at most 1 mm, measured by contacts and by
///   vertices inside closed meshes.
///
/// With CollisionOptions::unchecked, these rules do not apply: kReference has all other pairs of links with geometry,
/// kAll also those that never collided in samples (docs/explanation/judge.md#sampled-link-pairs).
///
/// Immutable; const members are thread-safe.
class CollisionModel {
 public:
  /// Status of a link pair.
  enum class PairStatus {
    kChecked,
    kIgnoredAdjacent,       ///< no more than one moving joint between them, or a link without geometry
    kIgnoredReferencePose,  ///< their meshes intersect at `reference_x`; only with PairSelection::kReference
    kIgnoredInseparable,    ///< no posture separates them; only with PairSelection::kAll
    kIgnoredAlways,         ///< UncheckedReason::kAlways, kStanding or kUser
    kIgnoredNever           ///< UncheckedReason::kNever; only with PairSelection::kReference
  };

  /// Builds the model. Link pairs that touch at the configuration `reference_x` (n + 7) are always ignored. Throws
  /// InputError: a mesh that cannot be loaded, a degenerate shape, wrong size of `reference_x`, bad options.
  static std::shared_ptr<const CollisionModel> Build(const RobotModel& robot, const Scene& scene,
                                                     Eigen::Ref<const Eigen::VectorXd> reference_x,
                                                     const CollisionOptions& options = {});

  ~CollisionModel();
  CollisionModel(const CollisionModel&) = delete;
  CollisionModel& operator=(const CollisionModel&) = delete;

  int num_links() const;
  /// Link pairs to be checked, ascending by (second, first), the order of the original evaluator.
  const std::vector<LinkPair>& checked_pairs() const;
  /// Returns the pairs of any selection, in the same order.
  const std::vector<LinkPair>& pairs(PairSelection selection) const;
  /// Returns the status of two different links, in any order. A link without geometry is adjacent to all.
  PairStatus pair_status(int a, int b) const;
  /// Checked pairs that use finer pieces, in the order of checked_pairs().
  const std::vector<LinkPair>& decomposed_pairs() const;
  /// Returns the number of convex shapes of a link, one per geometry; 0 if it has none.
  int num_link_pieces(int link) const;
  /// A ball in the link's frame, m. Radius < 0 for links without geometry.
  struct Ball {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< m, link frame
    double radius = -1.0;                              ///< m; < 0: the link has no geometry
  };
  /// Returns a ball that contains all shapes of the link.
  const Ball& link_ball(int link) const;

  SceneRepresentation scene_representation() const;  ///< type of the scene's obstacles: solids or triangles
  /// Number of convex obstacles of the scene: solids or triangles.
  int num_scene_solids() const;

  /// Returns true if the world point is inside a scene solid by more than `depth_m` [m]. Exact for hulls and
  /// primitives. A surface contains nothing. Slow; for tests and tools.
  bool SceneContains(const Eigen::Vector3d& point_W, double depth_m = 0.0) const;

  struct Impl;                                 // internal: defined in model_data.h
  const Impl& impl() const { return *impl_; }  ///< internal to this module

 private:
  explicit CollisionModel(std::unique_ptr<const Impl> impl);
  std::unique_ptr<const Impl> impl_;
};

/// Returns an upper bound of the straight-line distance that any point of the ball moves between two poses of its link,
/// m.
double MaxDisplacement(const CollisionModel::Ball& ball, const Eigen::Isometry3d& a, const Eigen::Isometry3d& b);

/// Triangles of the solver's convex shapes, for display; curved surfaces are tessellated. A shape without volume
/// contributes only its triangle, if it is one.

/// Returns the surfaces of a link, in its frame, m: the finer pieces if there are any, else one hull or primitive per
/// geometry. Empty for a link without geometry.
TriangleMesh LinkSurfaces(const CollisionModel& model, int link);

/// Returns the surfaces of all solid obstacles, in the world, m. Empty for a scene as a surface, which is its own mesh.
TriangleMesh SceneSurfaces(const CollisionModel& model);

}  // namespace legopt

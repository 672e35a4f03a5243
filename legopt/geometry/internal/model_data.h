#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <random>
#include <vector>

#include "legopt/geometry/collision_model.h"
#include "legopt/geometry/internal/convex_decomposition.h"
#include "legopt/geometry/internal/convex_shape.h"
#include "legopt/geometry/internal/link_trimeshes.h"
#include "legopt/geometry/internal/triangle_bvh.h"

namespace legopt {

/// Level of detail for checking a link pair.
enum class PairResolution : std::uint8_t {
  kHulls,   ///< one hull per mesh
  kPieces,  ///< decomposed meshes, if hulls would overlap in valid postures
  kBodies   ///< meshes decomposed body by body, if links reach into each other's hollows
};

/// Link pairs to be checked, and their level of detail.
struct LinkPairRules {
  std::vector<CollisionModel::PairStatus> status;         ///< num_links x num_links, row by row, symmetric
  EnumArray<PairSelection, std::vector<LinkPair>> pairs;  ///< pairs of each selection, ascending by (second, first)
  PairSelection selection = PairSelection::kReference;    ///< selection used by the solver
  /// Level of detail, num_links x num_links like `status`, for the solver's pairs. kPieces: the hulls overlap in a
  /// considerable share of the postures in which the meshes do not, or the links touch in the reference posture.
  /// kBodies: pairs whose pieces also overlap in most postures in which the meshes do not, and which touch in the
  /// reference posture or, with CollisionOptions::unchecked, are judged better by bodies (FalseDepth::score).
  std::vector<PairResolution> detail;
  std::vector<LinkPair> decomposed;  ///< the solver's pairs with more detail than hulls, in its order
  /// False depth (false_overlap.h) of each pair of `decomposed`, m; empty: all are 0. The solver's distances of a
  /// pair are larger by it. Otherwise no posture might be feasible, although the meshes are apart. Only for
  /// CollisionOptions::unchecked.
  std::vector<double> false_depths_m;

  const std::vector<LinkPair>& checked() const { return pairs[selection]; }  ///< pairs checked by the solver
  /// Returns the false depth of a pair, first < second.
  double FalseDepth_m(const LinkPair& pair) const;
};

/// Classifies all link pairs. `meshes`: the robot's exact meshes, whose poses are changed. `pieces`: those of the
/// robot. `reference_x`: see CollisionModel::Build. Deterministic: false overlaps are counted, and separable pairs are
/// detected, over a fixed sequence of postures, uniform within the joint limits.
LinkPairRules ClassifyLinkPairs(const RobotModel& robot, LinkTrimeshes& meshes, LinkPieces& pieces,
                                Eigen::Ref<const Eigen::VectorXd> reference_x, PairSelection selection);

/// Classifies the link pairs of CollisionOptions::unchecked, for any selection: SelectListedPairs completes the rules.
LinkPairRules ClassifyListedPairs(const RobotModel& robot, LinkTrimeshes& meshes, LinkPieces& pieces,
                                  const std::vector<UncheckedPair>& unchecked);

/// Sets the selection, and the status that depends on it.
void SelectListedPairs(const RobotModel& robot, const std::vector<UncheckedPair>& unchecked, PairSelection selection,
                       LinkPairRules* rules);

/// Returns all pairs of links with geometry, ascending by (second, first).
std::vector<LinkPair> ShapedPairs(const RobotModel& robot);

/// Returns one convex shape per geometry of a link: hulls of meshes, primitives as they are. Throws InputError with the
/// link's name.
std::vector<ConvexShape> HullsOf(const Link& link, const ReadGuard& guard);

/// Returns the configuration whose joints are uniform within their limits, [-pi, pi] without limits, by the next
/// num_dofs() random numbers; base upright at the origin.
Eigen::VectorXd SamplePosture(const RobotModel& robot, std::mt19937_64& random);

/// Consecutive shapes in the model's array.
struct ShapeRun {
  int first = 0;  ///< index into `shapes`
  int count = 0;
  int end() const { return first + count; }  ///< one past the last
};

/// Shapes of one link per level of detail; empty if no pair needs that level.
struct LinkShapes {
  ShapeRun hulls;   ///< one hull or primitive per geometry
  ShapeRun pieces;  ///< decomposed meshes
  ShapeRun bodies;  ///< meshes decomposed body by body
  ShapeRun scene;   ///< shapes against a scene of solids; empty: `hulls`
  /// Returns the shapes of a level of detail.
  const ShapeRun& Of(PairResolution detail) const {
    return detail == PairResolution::kHulls ? hulls : detail == PairResolution::kPieces ? pieces : bodies;
  }
  /// Returns the shapes that are compared with the scene.
  const ShapeRun& AgainstScene() const { return scene.count > 0 ? scene : hulls; }
  /// Shapes of the link's finest level of detail.
  const ShapeRun& Finest() const { return bodies.count > 0 ? bodies : pieces.count > 0 ? pieces : hulls; }
  /// Index into `shapes` of one hull around all pieces, which is tested first, or of the only piece; -1 if there is
  /// neither.
  int whole = -1;
  CollisionModel::Ball ball;  ///< contains all shapes, link frame
};

/// Data of a CollisionModel. Points of links are in link frames, points of obstacles in the world.
struct CollisionModel::Impl {
  std::vector<LinkShapes> links;
  std::vector<ConvexShape> shapes;        ///< shapes of all links and levels of detail, and their whole hulls
  std::vector<PointArena::Range> ranges;  ///< range in link_points per shape
  PointArena link_points;                 ///< points of all shapes, in their link's frame

  // Obstacles: solids, or the triangles of the surface.
  std::vector<ConvexShape> solids;           ///< empty for a surface
  PointArena solid_points;                   ///< points of all obstacles, in the world
  std::vector<SupportSet> solid_sets;        ///< per obstacle; refer to solid_points; bounds are exact
  std::optional<TriangleBvh> triangle_tree;  ///< surfaces only
  std::vector<HalfSpace> triangle_planes;    ///< surfaces only, per obstacle; zero normal for triangles without area
  SceneRepresentation scene{};               ///< type of the obstacles

  LinkPairRules pairs;

  bool surface() const { return scene != SceneRepresentation::kSolid; }  ///< the scene is made of triangles
  /// Returns the index of a link pair in LinkPairRules::status and LinkPairRules::detail.
  size_t PairIndex(int a, int b) const { return static_cast<size_t>(a) * links.size() + static_cast<size_t>(b); }
};

}  // namespace legopt

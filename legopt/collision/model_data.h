#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "legopt/collision/collision_model.h"
#include "legopt/collision/convex_shape.h"
#include "legopt/collision/link_pairs.h"
#include "legopt/collision/triangle_bvh.h"

namespace legopt {

/// Consecutive shapes within the model's array.
struct ShapeRun {
  int first = 0;                             ///< index into `shapes`
  int count = 0;                             ///< how many
  int end() const { return first + count; }  ///< behind the last
};

/// Shapes of one link, by the detail in which it is compared with other links; none where no pair asks for it.
struct LinkShapes {
  ShapeRun hulls;   ///< one hull or primitive per geometry
  ShapeRun pieces;  ///< decomposed meshes
  ShapeRun bodies;  ///< meshes decomposed body by body
  /// Those of a detail.
  const ShapeRun& Of(PairDetail detail) const {
    return detail == PairDetail::kHulls ? hulls : detail == PairDetail::kPieces ? pieces : bodies;
  }
  /// Those of the finest detail that the link has.
  const ShapeRun& Finest() const { return bodies.count > 0 ? bodies : pieces.count > 0 ? pieces : hulls; }
  /// Index into `shapes`: one hull round all pieces, to test first; the only piece; -1 when there is neither.
  int whole = -1;
  CollisionModel::Ball ball;  ///< holds all shapes, link frame
};

/// Data behind CollisionModel. Points of links are in link frames, points of obstacles in the world.
struct CollisionModel::Impl {
  std::vector<LinkShapes> links;          ///< by link
  std::vector<ConvexShape> shapes;        ///< of all links, of every detail, and their wholes
  std::vector<PointArena::Range> ranges;  ///< by shape: its points in link_points
  PointArena link_points;                 ///< of all shapes, each in the frame of its link

  // Obstacles: solids, or the triangles of the surface.
  std::vector<ConvexShape> solids;           ///< none for a surface
  PointArena solid_points;                   ///< of all obstacles, in the world
  std::vector<SupportSet> solid_sets;        ///< by obstacle; point into solid_points; bounds exact
  std::optional<TriangleBvh> triangle_tree;  ///< surfaces only
  std::vector<HalfSpace> triangle_planes;    ///< surfaces only, by obstacle; a zero normal for triangles without area
  SceneRepresentation scene{};               ///< what the obstacles are

  LinkPairRules pairs;  ///< which pairs are compared, and how

  bool surface() const { return scene != SceneRepresentation::kSolid; }  ///< the scene is made of triangles
  /// Of a pair of links in LinkPairRules::status and LinkPairRules::detail.
  size_t PairIndex(int a, int b) const { return static_cast<size_t>(a) * links.size() + static_cast<size_t>(b); }
};

}  // namespace legopt

#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "legopt/collision/collision_model.h"
#include "legopt/collision/convex_shape.h"
#include "legopt/collision/link_pairs.h"
#include "legopt/collision/triangle_bvh.h"

namespace legopt {

/// Shapes of one link within the model's arrays.
struct LinkShapes {
  int first_piece = 0;  ///< one hull or primitive per geometry
  int num_pieces = 0;   ///< one for each geometry
  int first_fine = 0;   ///< decomposition, only for links of phantom pairs
  int num_fine = 0;     ///< 0: the link is in no phantom pair
  /// Index into `shapes`: one hull round all pieces, to test first; the only piece; -1 when there is neither.
  int whole = -1;
  CollisionModel::Ball ball;  ///< holds all shapes, link frame
};

/// Data behind CollisionModel. Points of links are in link frames, points of obstacles in the world.
struct CollisionModel::Impl {
  std::vector<LinkShapes> links;          ///< by link
  std::vector<ConvexShape> shapes;        ///< pieces, fine pieces and wholes of all links
  std::vector<PointArena::Range> ranges;  ///< by shape: its points in link_points
  PointArena link_points;                 ///< of all shapes, each in the frame of its link

  // Obstacles: solids, or the triangles of the surface.
  std::vector<ConvexShape> solids;           ///< none for a surface
  PointArena solid_points;                   ///< of all obstacles, in the world
  std::vector<SupportSet> solid_sets;        ///< by obstacle; point into solid_points; bounds exact
  std::optional<TriangleBvh> triangle_tree;  ///< surfaces only
  std::vector<HalfSpace> triangle_planes;    ///< surfaces only, by obstacle; a zero normal for triangles without area
  SceneRepresentation scene{};               ///< what the obstacles are

  LinkPairRules pairs;     ///< which pairs are compared, and how
  std::vector<bool> fine;  ///< num_links x num_links: the pair is compared by fine pieces

  bool surface() const { return scene != SceneRepresentation::kSolid; }  ///< the scene is made of triangles
  /// Of a pair of links in `fine` and in LinkPairRules::status.
  size_t PairIndex(int a, int b) const { return static_cast<size_t>(a) * links.size() + static_cast<size_t>(b); }
};

}  // namespace legopt

#pragma once

#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "legopt/dataset/stance.h"

namespace legopt {

class Dataset;

/// A foot as the support polygon sees it: its link-frame box and where the link is.
struct FootPlacement {
  Eigen::AlignedBox3d box_F;  ///< link-frame AABB of the foot's geometry, metres
  Eigen::Isometry3d X_WF;     ///< link frame in the world
};

/// The set { c : normal . c + offset <= 0 }, `normal` unit and outward, world xy, metres.
struct HalfPlane {
  Eigen::Vector2d normal;  ///< unit, outward
  double offset;           ///< m

  /// Signed distance of c from the edge: > 0 outside.
  double Distance(const Eigen::Vector2d& c) const { return normal.dot(c) + offset; }
};

/// 2D convex hull, counter-clockwise, without collinear or repeated points (one or two points when all coincide or are
/// collinear). Monotone chain; deterministic.
std::vector<Eigen::Vector2d> ConvexHull2d(std::vector<Eigen::Vector2d> points);

/// Support polygon of the benchmark (docs/readings.md#support-polygon): hull of the four lower corners of every foot's
/// box, carried to the world by X_WF and projected on xy. Counter-clockwise.
std::vector<Eigen::Vector2d> SupportPolygon(std::span<const FootPlacement> feet);

/// SupportPolygon with the feet exactly on their targets: what an optimiser uses.
std::vector<Eigen::Vector2d> TargetSupportPolygon(const Dataset& dataset, const Stance& stance);

/// One half-plane per edge of a counter-clockwise convex polygon. A polygon that has collapsed to a segment or a point
/// gives four half-planes whose intersection is that segment or point. Must not be empty (abort).
std::vector<HalfPlane> Edges(std::span<const Eigen::Vector2d> polygon);

/// Largest signed distance of `c` over the edges: <= 0 inside, > 0 outside.
double SignedDistanceToPolygon(std::span<const Eigen::Vector2d> polygon, const Eigen::Vector2d& c);

}  // namespace legopt

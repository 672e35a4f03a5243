#pragma once

#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "legopt/dataset/stance.h"

namespace legopt {

class Dataset;
struct Contact;

/// A contact and the pose of its link, for the support polygon.
struct ContactPlacement {
  const Contact* contact = nullptr;  ///< not null; must outlive the placement
  Eigen::Isometry3d X_WL;            ///< link frame in the world
};

/// The set { c : normal . c + offset <= 0 } in the world's xy plane.
struct HalfPlane {
  Eigen::Vector2d normal;  ///< unit, outward
  double offset;           ///< m

  /// Returns the signed distance of c from the edge: > 0 outside.
  double Distance(const Eigen::Vector2d& c) const { return normal.dot(c) + offset; }
};

/// Computes the 2D convex hull, counter-clockwise, without collinear or repeated points (one or two points if all
/// coincide or are collinear). Monotone chain; deterministic.
std::vector<Eigen::Vector2d> ConvexHull2d(std::vector<Eigen::Vector2d> points);

/// Computes the benchmark's support polygon (docs/explanation/judge.md#support-polygon): hull of the points of all
/// contacts of a supporting kind (contact_kind.h), transformed to the world by X_WL and projected onto xy.
/// Counter-clockwise. For a sole of format 1, the points are the lower corners of the link's box.
std::vector<Eigen::Vector2d> SupportPolygon(std::span<const ContactPlacement> contacts);

/// Computes the SupportPolygon of contacts exactly at their targets, for optimizers.
std::vector<Eigen::Vector2d> TargetSupportPolygon(const Dataset& dataset, const Stance& stance);

/// Returns one half-plane per edge of a counter-clockwise convex polygon. A polygon that is only a segment or a point
/// gives four half-planes whose intersection is that segment or point. Aborts for an empty polygon.
std::vector<HalfPlane> Edges(std::span<const Eigen::Vector2d> polygon);

/// Returns the largest signed distance of `c` from the edges: <= 0 inside, > 0 outside.
double SignedDistanceToPolygon(std::span<const Eigen::Vector2d> polygon, const Eigen::Vector2d& c);

}  // namespace legopt

#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "legopt/geometry/internal/convex_shape.h"

namespace legopt {

/// Convex shapes of one link, transformed to the world. Not thread-safe.
class PlacedShapes {
 public:
  explicit PlacedShapes(std::vector<ConvexShape> shapes);
  PlacedShapes(PlacedShapes&&) = default;
  PlacedShapes& operator=(PlacedShapes&&) = delete;

  /// Moves the link to a pose in the world.
  void Place(const Eigen::Isometry3d& pose);

  /// Returns true if any shape overlaps one of `other` by more than `depth_m`, m, at the poses of the last Place().
  bool Overlap(const PlacedShapes& other, double depth_m) const;

  /// Returns the largest depth by which a shape overlaps one of `other`, m, if it exceeds `least_m` (negative: a gap);
  /// else `least_m`.
  double Depth(const PlacedShapes& other, double least_m) const;

 private:
  std::vector<ConvexShape> shapes_;
  PointArena local_, world_;
  std::vector<PointArena::Range> ranges_;
  std::vector<SupportSet> sets_;
  std::vector<Eigen::AlignedBox3d> boxes_;  ///< per shape, in the world
  Eigen::AlignedBox3d box_;                 ///< bounding box of all shapes, in the world
};

}  // namespace legopt

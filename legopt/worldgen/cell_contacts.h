#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "legopt/geometry/convex_shape.h"
#include "legopt/worldgen/fracture.h"

namespace legopt::worldgen {

/// Contact points between moving cells, for the simulation.
///
/// Pairs come from a sweep along x over bounding boxes. The normal is that of the exact signed distance; the points are
/// the vertices of either cell inside the other, and the deepest point. Not thread-safe.
class CellContacts {
 public:
  /// `cells` must outlive this object; initially all are at their positions in the intact building.
  explicit CellContacts(const std::vector<Cell>& cells);

  /// Sets the pose of a cell. `motion`: displacement from the intact building, see CellState.
  void Place(int cell, const Eigen::Isometry3d& motion);
  /// Removes a cell from the contact search.
  void Remove(int cell);
  /// Returns the bounding box of a cell at its current pose, world axes.
  const Eigen::AlignedBox3d& bounds(int cell) const { return bounds_[static_cast<size_t>(cell)]; }

  /// Returns the pairs (a < b) of present cells with overlapping boxes, at least one of them in `active`. Ascending.
  std::vector<std::pair<int, int>> Pairs(const std::vector<bool>& active) const;

  /// A contact point of two cells a and b, in the world.
  struct Point {
    Eigen::Vector3d position;  ///< between the two surfaces
    Eigen::Vector3d normal;    ///< direction from b to a
    double depth_m;            ///< >= 0
  };
  /// Maximum number of points per pair.
  static constexpr int kMaxPoints = 6;
  /// Computes at most kMaxPoints contact points of two cells; empty if they do not touch.
  std::vector<Point> Touch(int a, int b) const;

 private:
  SupportSet SetOf(int cell) const;
  double PlaneDistance(int cell, const Eigen::Vector3d& point) const;

  std::vector<ConvexShape> shapes_;
  std::vector<Eigen::Isometry3d> motions_;
  std::vector<bool> present_;
  std::vector<Eigen::AlignedBox3d> bounds_;
  PointArena rest_, placed_;
  std::vector<PointArena::Range> ranges_;
};

}  // namespace legopt::worldgen

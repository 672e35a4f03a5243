#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "legopt/collision/convex_shape.h"
#include "legopt/generate/fracture.h"

namespace legopt::generate {

/// Contact points between cells in motion, for the simulation.
///
/// Pairs come from a sweep along x over bounding boxes; the normal from the exact signed distance, the points are the
/// vertices of either cell inside of the other and the deepest point. One thread.
class CellContacts {
 public:
  /// `cells` must outlive this; all stand where the intact building has them.
  explicit CellContacts(const std::vector<Cell>& cells);

  /// `motion`: from the intact building, see CellState.
  void Place(int cell, const Eigen::Isometry3d& motion);
  /// Takes a cell out of the game.
  void Remove(int cell);
  /// Of a cell as placed, world axes.
  const Eigen::AlignedBox3d& bounds(int cell) const { return bounds_[static_cast<size_t>(cell)]; }

  /// Pairs (a < b) of present cells whose boxes overlap and of which at least one is in `active`. Ascending.
  std::vector<std::pair<int, int>> Pairs(const std::vector<bool>& active) const;

  /// One contact of two cells a and b, in the world.
  struct Point {
    Eigen::Vector3d position;  ///< between the two surfaces
    Eigen::Vector3d normal;    ///< from b to a
    double depth_m;            ///< >= 0
  };
  /// Most points of a pair.
  static constexpr int kMostPoints = 6;
  /// At most kMostPoints contact points of two cells; empty when they are apart.
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

}  // namespace legopt::generate

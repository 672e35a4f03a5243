#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <random>
#include <vector>

#include "legopt/geometry/internal/convex_shape.h"
#include "legopt/worldgen/internal/building.h"

namespace legopt::worldgen {

/// A convex cell, the smallest piece that a building can break into. World frame of the intact building, m.
struct Cell {
  std::vector<Eigen::Vector3d> vertices;               ///< vertices of the convex hull
  std::vector<std::vector<int>> faces;                 ///< vertex indices per face, counter-clockwise seen from outside
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();  ///< centroid of the volume, m
  double volume_m3 = 0.0;                              ///< > 0
  int member = -1;                                     ///< index into Building::members
};

/// Connection of two cells whose faces touch.
struct Bond {
  int a = -1,                                         ///< cell
      b = -1;                                         ///< cell, > a
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();   ///< centre of the contact area
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< direction from a to b
  double area_m2 = 0.0;                               ///< contact area
};

/// Options of fracturing.
struct FractureOptions {
  double fine_radius_m = 3.5;  ///< within this distance of the focus, cells have 0.7 times the edge length
  double jitter = 0.75;        ///< jitter of the seeds relative to the cell size, 0..1
};

/// Breaks every member into the Voronoi cells of jittered seeds (voro++). Members with cell_m = 0 give one cell. Along
/// an edge with only one cell, all seeds lie in the middle, so that plates break through their thickness.
///
/// The cells of a member fill it exactly, share their faces, and are in the order of the seeds; members in their order.
/// Deterministic: random numbers come from `generator` only.
std::vector<Cell> Fracture(const Building& building, const FractureOptions& options, std::mt19937_64& generator);

/// Finds all pairs of cells whose faces touch (gap below 3 mm, area at least 20 cm^2). Loose bodies have no bonds.
/// Ascending by (a, b), one bond per pair.
std::vector<Bond> FindBonds(const Building& building, const std::vector<Cell>& cells);

/// Returns a whole member as one cell.
Cell WholeCell(const Member& member, int index);

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

#pragma once

#include <Eigen/Core>
#include <random>
#include <vector>

#include "legopt/generate/building.h"

namespace legopt::generate {

/// A convex cell, the smallest part that a building can break into. World frame of the intact building, m.
struct Cell {
  std::vector<Eigen::Vector3d> vertices;               ///< of the hull
  std::vector<std::vector<int>> faces;                 ///< corners of each face, counter-clockwise seen from outside
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();  ///< of the volume, m
  double volume_m3 = 0.0;                              ///< > 0
  int member = -1;                                     ///< index in Building::members
};

/// Where two cells are joined: the area in which their faces touch.
struct Bond {
  int a = -1,                                         ///< cell
      b = -1;                                         ///< cell, > a
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();   ///< of the area in which they touch
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< from a to b
  double area_m2 = 0.0;                               ///< of that area
};

/// How fine a building breaks.
struct FractureOptions {
  double fine_radius_m = 3.5;  ///< about the focus, cells are 0.7 times as long within this distance
  double jitter = 0.75;        ///< of the seeds, as a share of the cell size, 0..1
};

/// Breaks every member into the Voronoi cells of jittered seeds (voro++). Members with cell_m = 0 give one cell. Along
/// an edge shorter than twice the cell size all seeds stand in the middle, so that plates break through their
/// thickness.
///
/// Cells of a member fill it exactly, share their faces, and come in the order of the seeds; members in their order.
/// Deterministic: draws from `generator` only.
std::vector<Cell> Fracture(const Building& building, const FractureOptions& options, std::mt19937_64& generator);

/// All pairs of cells whose faces touch (gap below 3 mm, area at least 20 cm^2), except between two loose bodies or a
/// loose body and anything else. Ascending by (a, b), one bond per pair.
std::vector<Bond> FindBonds(const Building& building, const std::vector<Cell>& cells);

/// The cell of a whole member.
Cell WholeCell(const Member& member, int index);

}  // namespace legopt::generate

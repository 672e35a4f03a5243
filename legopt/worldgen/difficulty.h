#pragma once

#include <Eigen/Geometry>

#include "legopt/geometry/terrain.h"

namespace legopt::worldgen {

/// Options of a measure for how hard a scene is to walk through. Samples are taken on a square grid in plan, on every
/// storey.
///
/// A sample is an upward surface. It is walkable if it is no steeper than `slope_rad`, if nothing is within
/// `headroom_m` above it, and if at least six of its eight neighbours have ground within `step_m` of its height.
struct DifficultyOptions {
  double grid_m = 0.2;      ///< spacing of the samples
  double slope_rad = 0.45;  ///< maximum slope of a walkable surface
  double headroom_m = 1.7;  ///< required free height
  double step_m = 0.12;     ///< maximum height difference between neighbours
};

/// Difficulty of a scene.
struct Difficulty {
  double walkable_m2 = 0.0;         ///< area of the walkable samples
  double height_variance_m2 = 0.0;  ///< variance of the height over 3 x 3 samples, mean over walkable samples
  double clearance_m = 0.0;         ///< free height above walkable samples, at most 3 m each, mean
};

/// Measures the difficulty of a scene. `plan`: region to sample.
Difficulty MeasureDifficulty(const Terrain& terrain, const Eigen::AlignedBox2d& plan,
                             const DifficultyOptions& options = {});

}  // namespace legopt::worldgen

#pragma once

#include <Eigen/Geometry>

#include "legopt/collision/terrain.h"

namespace legopt::generate {

/// How hard a scene is to walk through, from samples on a square grid in plan, on every storey.
///
/// A sample is a surface that looks up; it is walkable when it is no steeper than `slope_rad`, when nothing is within
/// `headroom_m` above it, and when at least six of its eight neighbours have ground within `step_m` of its height.
struct DifficultyOptions {
  double grid_m = 0.2;      ///< distance of the samples
  double slope_rad = 0.45;  ///< steepest walkable surface
  double headroom_m = 1.7;  ///< free height that a walker needs
  double step_m = 0.12;     ///< height difference to a neighbour that can be stepped over
};

/// What the samples say.
struct Difficulty {
  double walkable_m2 = 0.0;         ///< area of the walkable samples
  double height_variance_m2 = 0.0;  ///< of the surface over 3 x 3 samples, mean over walkable samples
  double clearance_m = 0.0;         ///< height free above walkable samples, at most 3 m each, mean
};

/// `plan`: where to sample.
Difficulty MeasureDifficulty(const Terrain& terrain, const Eigen::AlignedBox2d& plan,
                             const DifficultyOptions& options = {});

}  // namespace legopt::generate

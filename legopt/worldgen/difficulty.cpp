#include "legopt/worldgen/difficulty.h"

#include <algorithm>
#include <cmath>

namespace legopt::worldgen {
namespace {

/// Computes the variance of the ground height around a sample; returns the number of the eight neighbours that are
/// level with it.
int MeasureNeighbours(const Terrain& terrain, double x, double y, double z, const DifficultyOptions& options,
                      double& variance) {
  constexpr double kWindow_m = 0.6;  // includes rubble and steps, excludes other storeys
  double sum = 0.0;
  double squares = 0.0;
  int found = 0;
  int level = 0;
  for (int dx = -1; dx <= 1; ++dx) {
    for (int dy = -1; dy <= 1; ++dy) {
      const Terrain::Hit hit =
          terrain.Highest(x + dx * options.grid_m, y + dy * options.grid_m, z - kWindow_m, z + kWindow_m);
      if (hit.triangle < 0) continue;
      const double height = hit.z_m - z;
      sum += height;
      squares += height * height;
      ++found;
      level += std::abs(height) <= options.step_m && (dx != 0 || dy != 0) ? 1 : 0;
    }
  }
  variance = found > 0 ? std::max(0.0, squares / found - (sum / found) * (sum / found)) : 0.0;
  return level;
}

}  // namespace

Difficulty MeasureDifficulty(const Terrain& terrain, const Eigen::AlignedBox2d& plan,
                             const DifficultyOptions& options) {
  constexpr double kMaxClearance_m = 3.0;
  constexpr int kLevelNeighbours = 6;
  Difficulty result;
  int walkable = 0;
  std::vector<Terrain::Hit> hits;
  const double least_nz = std::cos(options.slope_rad);
  for (double y = plan.min().y() + 0.5 * options.grid_m; y < plan.max().y(); y += options.grid_m) {
    for (double x = plan.min().x() + 0.5 * options.grid_m; x < plan.max().x(); x += options.grid_m) {
      terrain.Ground(x, y, terrain.bounds().min().z(), terrain.bounds().max().z(), hits);
      for (const Terrain::Hit& hit : hits) {
        if (terrain.normal(hit.triangle).z() < least_nz) continue;
        const double clearance = terrain.CeilingHeight(x, y, hit.z_m) - hit.z_m;
        double variance = 0.0;
        if (clearance < options.headroom_m ||
            MeasureNeighbours(terrain, x, y, hit.z_m, options, variance) < kLevelNeighbours)
          continue;
        ++walkable;
        result.height_variance_m2 += variance;
        result.clearance_m += std::min(clearance, kMaxClearance_m);
      }
    }
  }
  result.walkable_m2 = walkable * options.grid_m * options.grid_m;
  if (walkable == 0) return result;
  result.height_variance_m2 /= walkable;
  result.clearance_m /= walkable;
  return result;
}

}  // namespace legopt::worldgen

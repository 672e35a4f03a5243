#pragma once

#include <Eigen/Geometry>
#include <random>
#include <utility>
#include <vector>

#include "legopt/geometry/internal/terrain.h"
#include "legopt/worldgen/internal/stance_probe.h"

namespace legopt::worldgen {

/// Triangles flat enough to stand on, with cumulative areas, for random points uniform by area. Immutable and
/// thread-safe; refers to the model.
class WalkableArea {
 public:
  /// `region`: triangles whose box in plan does not meet it are left out; empty: everywhere.
  WalkableArea(const ProbeModel& model, const Eigen::AlignedBox2d& region);

  /// Returns true if there is no such triangle.
  bool empty() const { return triangles_.empty(); }
  /// Returns a random point, uniform by area, and its triangle. Must not be empty.
  std::pair<Eigen::Vector3d, int> Sample(std::mt19937_64& generator) const;

 private:
  const Terrain& terrain_;
  std::vector<int> triangles_;
  std::vector<double> sums_;
};

}  // namespace legopt::worldgen

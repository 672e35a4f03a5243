#include "legopt/worldgen/internal/walkable_area.h"

#include <algorithm>
#include <cmath>

#include "legopt/math/random_numbers.h"

namespace legopt::worldgen {

WalkableArea::WalkableArea(const ProbeModel& model, const Eigen::AlignedBox2d& region) : terrain_(model.terrain) {
  const double least_nz = std::cos(model.options.slope_rad);
  double sum = 0.0;
  for (size_t t = 0; t < terrain_.mesh().triangles.size(); ++t) {
    const int triangle = static_cast<int>(t);
    if (terrain_.normal(triangle).z() < least_nz) continue;
    Eigen::AlignedBox2d box;
    for (const int corner : terrain_.mesh().triangles[t]) {
      box.extend(Eigen::Vector2d(terrain_.mesh().vertices[static_cast<size_t>(corner)].head<2>()));
    }
    if (!region.isEmpty() && !region.intersects(box)) continue;
    sum += terrain_.area_m2(triangle);
    triangles_.push_back(triangle);
    sums_.push_back(sum);
  }
}

std::pair<Eigen::Vector3d, int> WalkableArea::Sample(std::mt19937_64& generator) const {
  const double target = UniformRandom(generator) * sums_.back();
  const auto found = std::min<std::ptrdiff_t>(std::upper_bound(sums_.begin(), sums_.end(), target) - sums_.begin(),
                                              std::ssize(sums_) - 1);
  const int triangle = triangles_[static_cast<size_t>(found)];
  const double root = std::sqrt(UniformRandom(generator));
  const double share = UniformRandom(generator);
  const auto& corners = terrain_.mesh().triangles[static_cast<size_t>(triangle)];
  const auto at = [&](size_t k) { return terrain_.mesh().vertices[static_cast<size_t>(corners[k])]; };
  return {(1.0 - root) * at(0) + root * (1.0 - share) * at(1) + root * share * at(2), triangle};
}

}  // namespace legopt::worldgen

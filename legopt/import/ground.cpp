#include "legopt/import/ground.h"

#include <cmath>
#include <vector>

namespace legopt {

Ground FindGround(const Terrain& terrain, const Eigen::Vector3d& position) {
  constexpr double kRange_m = 0.3;
  std::vector<Terrain::Hit> hits;
  terrain.Ground(position.x(), position.y(), position.z() - kRange_m, position.z() + kRange_m, hits);
  Ground ground;
  for (const Terrain::Hit& hit : hits) {
    const Eigen::Vector3d& normal = terrain.normal(hit.triangle);
    const double gap_m = (position.z() - hit.z_m) * normal.z();
    if (ground.found && std::abs(gap_m) >= std::abs(ground.gap_m)) continue;
    ground = {.gap_m = gap_m, .point = {position.x(), position.y(), hit.z_m}, .normal = normal, .found = true};
  }
  return ground;
}

}  // namespace legopt

#pragma once

#include <Eigen/Core>

#include "legopt/geometry/terrain.h"

namespace legopt {

/// The surface above or below a position.
struct Ground {
  double gap_m = 0.0;  ///< distance from the surface along its normal; > 0: the position is above
  Eigen::Vector3d point = Eigen::Vector3d::Zero();    ///< point of the surface
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, up
  bool found = false;                                 ///< false: no surface is near, and the other members are
                                                      ///< undefined
};

/// Returns the upward surface nearest to the position, at most 0.3 m above or below.
Ground FindGround(const Terrain& terrain, const Eigen::Vector3d& position);

}  // namespace legopt

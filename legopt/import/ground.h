#pragma once

#include <Eigen/Core>

#include "legopt/collision/terrain.h"

namespace legopt {

/// A surface near a position, straight above or below it.
struct Ground {
  double gap_m = 0.0;  ///< from the surface to the position along the surface's normal; > 0: the position is above
  Eigen::Vector3d point = Eigen::Vector3d::Zero();    ///< of the surface
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, up
  bool found = false;                                 ///< false: no surface is near, and the rest means nothing
};

/// The surface that looks up nearest to the position, at most 0.3 m above or below.
Ground FindGround(const Terrain& terrain, const Eigen::Vector3d& position);

}  // namespace legopt

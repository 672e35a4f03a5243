#pragma once

#include <Eigen/Geometry>

namespace legopt {

/// Returns the smallest rotation that turns one direction into another one. Not inline, because Eigen's function takes
/// ten seconds to compile (a singular value decomposition handles opposite directions).
Eigen::Quaterniond SmallestRotation(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

}  // namespace legopt

#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "legopt/geometry/internal/ball.h"

namespace legopt {

using Triangle = std::array<Eigen::Vector3d, 3>;  ///< corners, m

/// Returns the ball of a rounded end: fitted to the points near the lowest one, if they and the triangles between them
/// lie on a ball; else, with radius 0, the lowest point, or the middle of an edge that is as low. `points`: corners of
/// `triangles`, not empty; `up`: unit.
Ball LowestBall(const std::vector<Eigen::Vector3d>& points, const std::vector<Triangle>& triangles,
                const Eigen::Vector3d& up);

}  // namespace legopt

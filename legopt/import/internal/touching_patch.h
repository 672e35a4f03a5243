#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "legopt/geometry/internal/triangle_columns.h"

namespace legopt {

/// Returns the part of a sole that touches a plane: `polygon` (convex, counter-clockwise), if its underside is within
/// 0.7 mm of the plane over at least 85 % of it; else the largest rectangle along the axes for which that holds, as of
/// a sole with an arch or a raised toe, and whose corners touch; nothing if there is none. `underside`: triangles of
/// the foot in a frame whose z axis is the plane's normal; `plane`: its height in this frame, m.
std::optional<std::vector<Eigen::Vector2d>> TouchingPatch(const std::vector<Eigen::Vector2d>& polygon,
                                                          const TriangleColumns& underside, double plane);

}  // namespace legopt

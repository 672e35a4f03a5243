#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "legopt/geometry/internal/triangle_columns.h"

namespace legopt {

/// Area below which a foot has no sole, m^2.
inline constexpr double kFlatArea_m2 = 8e-4;

/// Returns the part of a sole that touches a plane.
///
/// That is `polygon` (convex, counter-clockwise) if its underside is within 0.7 mm of the plane over at least 85 % of
/// it, or, with `on_parts`, if the judge accepts it as a foot on parts (kPartOutlineShare). Else it is the largest
/// rectangle along the axes for which the 85 % hold and whose corners touch, as of a sole with an arch or a raised toe.
/// If that is smaller than kFlatArea_m2, it is, with `on_parts`, the hull of the parts within kPartHeight_m of the
/// plane, if this is not. Returns nothing if no rectangle touches and the hull is smaller as well. `underside`:
/// triangles of the foot in a frame whose z axis is the plane's normal; `plane`: its height in this frame, m.
std::optional<std::vector<Eigen::Vector2d>> TouchingPatch(const std::vector<Eigen::Vector2d>& polygon,
                                                          const TriangleColumns& underside, double plane,
                                                          bool on_parts);

}  // namespace legopt

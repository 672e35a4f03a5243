#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace legopt {

/// Triangulates a simple polygon with holes by ear clipping.
///
/// `points`: positions in the plane, m. `outline`: indices into them, counter-clockwise. `holes`: clockwise outlines
/// inside it. The triangles are counter-clockwise and use every edge of the outlines exactly once, so that they close a
/// surface that has these edges the other way round. Triangles without area occur only if corners lie on one line.
/// Returns nothing if the outlines cross or have more than 20,000 corners. O(n^2) for usual outlines.
std::vector<std::array<int, 3>> TriangulatePolygon(const std::vector<Eigen::Vector2d>& points,
                                                   const std::vector<int>& outline,
                                                   const std::vector<std::vector<int>>& holes);

/// Returns twice the signed area of an outline, m^2; positive if it is counter-clockwise.
double TwiceAreaOf(const std::vector<Eigen::Vector2d>& points, const std::vector<int>& outline);

/// Returns true if the point is inside of the outline, whatever its direction.
bool IsInside(const Eigen::Vector2d& point, const std::vector<Eigen::Vector2d>& points,
              const std::vector<int>& outline);

}  // namespace legopt

#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <optional>
#include <vector>

namespace legopt {

/// A point of a planar convex set, furthest in a direction.
struct Extreme {
  Eigen::Vector2d direction;  ///< unit
  Eigen::Vector2d position;
};

/// Returns the furthest point of a set in a direction; empty if it was not found.
using Furthest = std::function<std::optional<Extreme>(const Eigen::Vector2d& direction)>;

/// Returns the directions of the axes, counter-clockwise from +x.
std::array<Eigen::Vector2d, 4> AxisDirections();

/// Approximates a planar convex set from within by points of its boundary. `furthest` is the only description of the
/// set. The first directions are those of the axes. Each further point is searched where the set may exceed the hull of
/// the points most, until it exceeds the hull by at most `accuracy`. Returns the points in the order of their
/// directions, counter-clockwise; fewer than four if a search along an axis failed.
///
/// Source: Bretl, Lall, Testing Static Equilibrium for Legged Robots, IEEE T-RO 24(4), 2008.
std::vector<Extreme> SearchExtremes(const Furthest& furthest, double accuracy);

}  // namespace legopt

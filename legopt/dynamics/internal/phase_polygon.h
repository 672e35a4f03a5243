#pragma once

#include <vector>

#include "legopt/dynamics/phase_set.h"

namespace legopt {

/// Corner of a polygon of the phase plane, with the owner of the edge that begins there.
struct PhaseCorner {
  Eigen::Vector2d at;
  LimitOwner owner;
};

/// Removes corners that coincide with the one before. `rounding`: distance of corners that count as one.
void MergeCorners(double rounding, std::vector<PhaseCorner>* corners);

/// Keeps the part of a convex polygon with normal . at <= offset; the new edge has the given owner.
void ClipPolygon(const Eigen::Vector2d& normal, double offset, const LimitOwner& owner, double rounding,
                 std::vector<PhaseCorner>* corners);

/// Returns the set with these corners (counter-clockwise, at least one) times `unit`, also for one or two corners.
PhaseSet SetOf(const std::vector<PhaseCorner>& corners, double unit);

/// Returns the corners of a set that is not empty, divided by `unit`.
std::vector<PhaseCorner> CornersOf(const PhaseSet& set, double unit);

}  // namespace legopt

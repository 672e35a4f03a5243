#pragma once

#include <random>
#include <vector>

#include "legopt/statics/stance_forces.h"

namespace legopt::test {

/// Returns one to four surfaces with one to four points each, with normals of up to 75 degrees from the vertical (a
/// sixth of them walls), friction 0.2 to 1, some bounded.
std::vector<TouchedSurface> RandomSurfaces(std::mt19937_64& random);

/// Returns RandomSurfaces, about half of them bars with two points and a bound of 0.05 to 0.5 of the weight.
std::vector<TouchedSurface> RandomSurfacesAndBars(std::mt19937_64& random);

/// Returns stances at the edge of what linear programs can tell: one, two or three points, coinciding and collinear
/// corners, opposite walls, opposite vertical normals, a patch of 0.2 mm.
std::vector<TouchedSurface> DegenerateSurfaces(std::mt19937_64& random);

/// Returns a position of the centre of mass near the surfaces.
Eigen::Vector3d RandomCom(const std::vector<TouchedSurface>& surfaces, std::mt19937_64& random);

}  // namespace legopt::test

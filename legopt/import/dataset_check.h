#pragma once

#include <memory>
#include <vector>

#include "legopt/collision/terrain.h"
#include "legopt/dataset/dataset.h"
#include "legopt/import/finding.h"
#include "legopt/import/footholds.h"

namespace legopt {

/// @file
/// Each check looks at one thing and returns what it found: at least one finding, so that a report shows that it was
/// looked at. None throws for what it finds, nor prints. They change nothing.

/// Closed meshes with outward winding, of the scene. A few open edges are a warning, many (over 1 %) an error, for the
/// judge sees triangles and the solver solids; inverted bodies are an error.
std::vector<DatasetFinding> CheckSceneMeshes(const Dataset& dataset);

/// Extents of every mesh of scene and robot, which show lengths in another unit and axes that are swapped, and the
/// COLLADA meshes whose up axis is not z. Empty without meshes.
std::vector<DatasetFinding> CheckMeshSizes(const Dataset& dataset);

/// The robot: masses, links without geometry, feet that are lowest in the nominal posture, winding of its meshes.
std::vector<DatasetFinding> CheckRobot(const Dataset& dataset);

/// Gap between footholds and the surface along its normal: hovering (above 2 mm), sunk (below -2 mm), no surface near.
/// More than half of them off the surface is an error.
std::vector<DatasetFinding> CheckFootholdHeights(const Dataset& dataset, std::span<const UsedFoothold> footholds,
                                                 const Terrain& terrain);

/// How much of each sole's rectangle rests on the surface (45 points within 3 mm of the sole's plane, a foothold that
/// hovers lowered first), and how steep the surface is.
std::vector<DatasetFinding> CheckSoles(const Dataset& dataset, std::span<const UsedFoothold> footholds,
                                       const Terrain& terrain);

/// Feet that are in collision with the scene although they stand exactly at their target (deeper than the judge's
/// 1 mm, by the solver's solids): problems that nobody can solve.
std::vector<DatasetFinding> CheckFootCollisions(const Dataset& dataset, std::span<const UsedFoothold> footholds);

/// Problems with a stance over which the robot, upright in its nominal posture with its soles at the stance's height,
/// has trunk, arms or head in the scene (everything but the links from the base to the feet; by the solver's solids).
std::vector<DatasetFinding> CheckTrunk(const Dataset& dataset);

/// All of them, what is hardly meant (plausibility.h), and the order of quaternions (quaternion_order.h). What depends
/// on an orientation or a winding that is wrong is left out.
std::vector<DatasetFinding> CheckDataset(const Dataset& dataset);

}  // namespace legopt

#pragma once

#include <memory>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/geometry/internal/terrain.h"
#include "legopt/import/internal/dataset_diagnostic.h"
#include "legopt/import/internal/used_contacts.h"

namespace legopt {

/// Finds values that are valid but suspicious. All findings are warnings, and there may be none. Checks numbers only,
/// within a millisecond.
///
/// Sizes that suggest millimetres: a scene wider than 200 m, a robot larger than 10 m. Limits that suggest degrees
/// (beyond 2 pi + 0.1 rad on a revolute joint), joints with equal limits, moving bodies with geometry but no mass,
/// joints without axis, physically impossible inertias (urdf_check.h).
std::vector<DatasetDiagnostic> CheckPlausibility(const Dataset& dataset);

/// Returns true if the scene is more than a thousand times as large as the robot in its nominal posture.
bool IsSceneTooLarge(const Dataset& dataset);

// Checks of a dataset. Each check returns at least one finding, unless noted otherwise, so that a report lists every
// check. Problems are returned as findings, never thrown or printed. The dataset is not changed.

/// Checks that the scene's meshes are closed with outward winding. A few open edges are a warning, more than 1 % an
/// error, since the judge uses triangles and the solver solids. Inverted bodies are an error. Cavities and bodies
/// without volume are warnings.
std::vector<DatasetDiagnostic> CheckSceneMeshes(const Dataset& dataset);

/// Reports the extents of every mesh of scene and robot, which reveal wrong units and swapped axes, and the COLLADA
/// meshes whose up axis is not z. Empty without meshes.
std::vector<DatasetDiagnostic> CheckMeshSizes(const Dataset& dataset);

/// Checks the robot: masses, links without geometry, feet that are lowest in the nominal posture, winding of its
/// meshes.
std::vector<DatasetDiagnostic> CheckRobot(const Dataset& dataset);

/// Checks the gap between contacts and the surface along its normal: floating (above 2 mm), sunk (below -2 mm), no
/// surface nearby. It is an error if more than half of them are off the surface.
std::vector<DatasetDiagnostic> CheckContactHeights(const Dataset& dataset, std::span<const UsedContact> contacts,
                                                   const Terrain& terrain);

/// Checks the supported share of each contact patch and the slope of the surface. A patch is sampled at 45 points,
/// which must be within 3 mm of its plane; a floating contact is lowered first.
std::vector<DatasetDiagnostic> CheckSoles(const Dataset& dataset, std::span<const UsedContact> contacts,
                                          const Terrain& terrain);

/// Finds feet that collide with the scene when exactly at their target (deeper than the judge's 1 mm, using the
/// solver's solids), which makes the problem infeasible.
std::vector<DatasetDiagnostic> CheckFootCollisions(const Dataset& dataset, std::span<const UsedContact> contacts);

/// Finds problems with a stance at which trunk, arms or head collide with the scene if the robot stands upright in its
/// nominal posture with its contact patches at the stance's height. Covers all links except those from the base to the
/// feet; uses the solver's solids.
std::vector<DatasetDiagnostic> CheckTrunk(const Dataset& dataset);

/// Runs all checks, those of dataset_check.h and the check of the quaternion order (used_contacts.h). Checks that
/// depend on a wrong orientation or winding are omitted.
std::vector<DatasetDiagnostic> CheckDataset(const Dataset& dataset);

}  // namespace legopt

#pragma once

#include "legopt/dataset/dataset.h"
#include "legopt/worldgen/stance_probe.h"

namespace legopt::worldgen {

/// Throws InputError for the first mesh with holes or inverted winding, about which solver and judge would disagree.
void RequireClosedMeshes(const Dataset& dataset);

/// Throws InputError unless, of two feet, the first is on the left in the nominal posture, as planning assumes.
void RequireLeftFootFirst(const Dataset& dataset);

/// Throws InputError for a scene of more than 4 million squares of 20 cm in plan (400 m x 400 m): the size of the map
/// that guides plans (guide_map.h) is proportional to this area.
void RequireMappableScene(const Dataset& dataset);

/// Checks a source before generation starts: see ProbeOptions::Validate and RequireLeftFootFirst and, if its own scene
/// is used, RequireMappableScene and RequireClosedMeshes; the scene must also have ground to stand on. Throws
/// InputError with the user's files and flags.
void CheckSource(const std::shared_ptr<const Dataset>& source, const ProbeOptions& options, bool uses_scene);

}  // namespace legopt::worldgen

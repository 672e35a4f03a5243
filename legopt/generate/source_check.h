#pragma once

#include "legopt/dataset/dataset.h"
#include "legopt/generate/stance_probe.h"

namespace legopt::generate {

/// Meshes that solver and judge would disagree about: with holes, or wound inside out. Throws InputError for the first.
void RequireSoundMeshes(const Dataset& dataset);

/// Of two feet, the first stands to the left in the nominal posture, as plans take it. Throws InputError.
void RequireLeftFootFirst(const Dataset& dataset);

/// A scene of at most 4 million squares of 20 cm in plan (400 m x 400 m): the map that guides plans (guide_map.h) grows
/// with its area. Throws InputError.
void RequireMappableScene(const Dataset& dataset);

/// Refuses, before anything is made, what a generation from this source would refuse: see ProbeOptions::Validate and
/// RequireLeftFootFirst, and, when its own scene is used, RequireMappableScene, RequireSoundMeshes and a scene without
/// ground to stand on. Throws InputError that names the user's files and flags.
void CheckSource(const std::shared_ptr<const Dataset>& source, const ProbeOptions& options, bool uses_scene);

}  // namespace legopt::generate

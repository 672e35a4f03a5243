#pragma once

#include <filesystem>

#include "legopt/geometry/scene.h"
#include "legopt/types/read_guard.h"

namespace legopt {

/// Returns true for the suffixes .sdf and .world, in upper or lower case.
bool IsSdfFile(const std::filesystem::path& path);

/// Reads the collision shapes of a Gazebo world or model (SDF up to 1.9, by libsdformat) as obstacles at their initial
/// poses: boxes, spheres, cylinders, capsules, planes (the slab 0.5 m below, at least 40 x 40 m, since they are
/// infinite in Gazebo), meshes and height maps (whose surface lies at the pose). Objects are named
/// model/link/collision.
///
/// Included models are searched in the folder of the file, its subfolder `models`, and likewise in three folders above.
/// Gazebo's `ground_plane` and `sun` need no files. libsdformat runs under `guard`. Throws InputError: invalid SDF,
/// a model or mesh that is not found, a shape of another kind, no collision shape.
Scene ReadSdfWorld(const std::filesystem::path& path, const ReadGuard& guard);

}  // namespace legopt

#pragma once

#include <Eigen/Geometry>

#include "legopt/robot/robot_model.h"

namespace legopt {

/// Computes the axis-aligned bounding box of a link's collision geometry, in the link frame, metres. Exact for
/// primitives (cylinders are not replaced by prisms); meshes are loaded under `guard`. Empty if the link has no
/// geometry. Throws InputError for a mesh that cannot be loaded.
Eigen::AlignedBox3d LinkBox(const Link& link, const ReadGuard& guard = {});

}  // namespace legopt

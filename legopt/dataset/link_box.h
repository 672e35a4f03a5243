#pragma once

#include <Eigen/Geometry>

#include "legopt/robot/robot_model.h"

namespace legopt {

/// Axis-aligned box of all collision geometry of a link, in the link frame, metres. Exact for primitives (a cylinder's
/// true extent, not that of an inscribed prism); meshes are loaded under `guard`. Empty when the link has no geometry.
/// Throws InputError for a mesh that cannot be loaded.
Eigen::AlignedBox3d LinkBox(const Link& link, const ReadGuard& guard = {});

}  // namespace legopt

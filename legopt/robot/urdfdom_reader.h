#pragma once

#include <string>
#include <vector>

#include "legopt/robot/robot_model.h"
#include "legopt/robot/urdf_check.h"
#include "legopt/types/read_guard.h"

namespace legopt {

/// Links and joints as urdfdom reads them: mesh names as in the file, tree indices not set.
struct UrdfContent {
  std::vector<Link> links;    ///< ordered as CheckedUrdf::links
  std::vector<Joint> joints;  ///< ordered as CheckedUrdf::joints; fixed joints without axis and limits
};

/// Reads a checked URDF with urdfdom, under the guard if there is one. Throws InputError if urdfdom logs an error,
/// throws, or omits a link, shape or joint, none of which should happen for the output of CheckUrdf, and if the guard
/// returns no answer. Thread-safe.
UrdfContent ReadByUrdfdom(const CheckedUrdf& urdf, const ReadGuard& guard);

}  // namespace legopt

#pragma once

#include <string>
#include <vector>

#include "legopt/robot/robot_model.h"
#include "legopt/robot/urdf_check.h"

namespace legopt {

/// Links and joints as urdfdom reads them: mesh names as in the file, tree indices not set.
struct UrdfContent {
  std::vector<Link> links;    ///< ordered as CheckedUrdf::links
  std::vector<Joint> joints;  ///< ordered as CheckedUrdf::joints; fixed joints without axis and limits
};

/// Reads a checked URDF with urdfdom in the calling thread. CheckUrdf admits no text that urdfdom rejects or misreads;
/// as a second line of defence, throws InputError if urdfdom logs an error, throws, or omits a link, shape or joint.
/// Thread-safe.
UrdfContent ReadByUrdfdom(const CheckedUrdf& urdf);

}  // namespace legopt

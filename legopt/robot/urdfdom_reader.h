#pragma once

#include <string>
#include <vector>

#include "legopt/read_guard.h"
#include "legopt/robot/robot_model.h"
#include "legopt/robot/urdf_check.h"

namespace legopt {

/// What urdfdom reads. Names of meshes stand as in the file; neither joints nor links know their place in the tree.
struct UrdfContent {
  std::vector<Link> links;    ///< in the order of CheckedUrdf::links
  std::vector<Joint> joints;  ///< in the order of CheckedUrdf::joints; fixed joints without axis and limits
};

/// Reads a checked URDF with urdfdom, under the guard when there is one. Throws InputError when urdfdom logs an error,
/// throws, or leaves a link, shape or joint out - none of that happens for a text that CheckUrdf made - and when the
/// guard gives no answer. Thread-safe.
UrdfContent ReadByUrdfdom(const CheckedUrdf& urdf, const ReadGuard& guard);

}  // namespace legopt

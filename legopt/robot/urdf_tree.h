#pragma once

#include <string>

#include "legopt/robot/robot_model.h"
#include "legopt/robot/urdf_check.h"
#include "legopt/robot/urdfdom_reader.h"

namespace legopt {

/// Throws InputError unless the joints form a single tree of all links.
void CheckUrdfTree(const CheckedUrdf& urdf);

/// Sorts links and joints into the order of RobotModel and resolves mesh paths (RobotModel::FromUrdfFile).
///
/// Throws InputError for meshes that do not exist, zero joint axes, lower limits above upper ones, and values in
/// `content` that are not finite.
RobotModel BuildUrdfTree(const CheckedUrdf& urdf, const UrdfContent& content, const std::string& mesh_folder);

}  // namespace legopt

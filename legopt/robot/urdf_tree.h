#pragma once

#include <string>

#include "legopt/robot/robot_model.h"
#include "legopt/robot/urdf_check.h"
#include "legopt/robot/urdfdom_reader.h"

namespace legopt {

/// Throws InputError unless the joints make one tree of all links.
void CheckUrdfTree(const CheckedUrdf& urdf);

/// Puts links and joints into the order of RobotModel and finds the files of their meshes (RobotModel::FromUrdfFile).
///
/// Throws InputError: meshes that do not exist, joints without direction or with the lower limit
/// above the upper one, and whatever in `content` is not finite.
RobotModel BuildUrdfTree(const CheckedUrdf& urdf, const UrdfContent& content, const std::string& mesh_folder);

}  // namespace legopt

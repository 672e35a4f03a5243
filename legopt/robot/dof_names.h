#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "legopt/robot/robot_model.h"

namespace legopt {

/// Returns the joint names of all degrees of freedom, in the order of configurations.
std::vector<std::string> DofNames(const RobotModel& robot);

/// Returns "revolute", "continuous", "prismatic" or "fixed".
std::string_view ToString(JointType type);

/// Returns the unit of a joint's value: "m" for prismatic joints, else "rad".
std::string_view UnitOf(JointType type);

}  // namespace legopt

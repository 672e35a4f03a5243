#include "legopt/robot/dof_names.h"

namespace legopt {

std::vector<std::string> DofNames(const RobotModel& robot) {
  std::vector<std::string> names;
  for (int dof = 0; dof < robot.num_dofs(); ++dof) {
    names.push_back(robot.joints()[static_cast<size_t>(robot.dof_joint(dof))].name);
  }
  return names;
}

std::string_view ToString(JointType type) {
  switch (type) {
    case JointType::kRevolute:
      return "revolute";
    case JointType::kContinuous:
      return "continuous";
    case JointType::kPrismatic:
      return "prismatic";
    case JointType::kFixed:
      break;
  }
  return "fixed";
}

std::string_view UnitOf(JointType type) { return type == JointType::kPrismatic ? "m" : "rad"; }

}  // namespace legopt

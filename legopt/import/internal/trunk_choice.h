#pragma once

#include <string>
#include <vector>

#include "legopt/dataset/contact.h"
#include "legopt/robot/robot_model.h"

namespace legopt {

/// Returns the name of the trunk's link (Trunk in dataset.h): of the bodies from which each contact's chain leaves by
/// another joint, the one whose chains to the contacts have the most equal numbers of joints. If several bodies tie,
/// the heaviest is used. In this body, the root link if it has mass, else the heaviest link. Without such a body, as
/// for a spine with joints or a single contact, the root link. Contacts whose link does not exist are ignored.
std::string FindTrunk(const RobotModel& robot, const std::vector<ContactDescription>& contacts);

}  // namespace legopt

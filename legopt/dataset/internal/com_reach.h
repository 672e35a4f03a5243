#pragma once

#include "legopt/dataset/contact.h"
#include "legopt/robot/robot_model.h"

namespace legopt {

/// Returns an upper bound of the distance, m, of the robot's centre of mass from a contact, in any posture:
///
///     R = sum_i (m_i / M) D_i,    D_i = |p - a_1| + |a_1 - a_2| + .. + |a_k - c_i|
///
/// with p the contact frame's origin, c_i the centre of mass of link i and a_1 .. a_k the origins of the joints between
/// them: the distance between neighbours is that of two points of one body, and prismatic joints add their range.
/// Infinite if such a joint has no limits.
///
/// Source: triangle inequality along the chain.
double ComReach_m(const RobotModel& robot, const Contact& contact);

}  // namespace legopt

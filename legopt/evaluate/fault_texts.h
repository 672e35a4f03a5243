#pragma once

#include <string>

#include "legopt/evaluate/foot_pose_error.h"

namespace legopt {

/// @file
/// How the judge's findings read: numbers with four digits, lengths in mm below a metre.

/// A number.
std::string NumberText(double value);
/// A length, given in metres.
std::string LengthText(double value_m);
/// Which foot, which component, by how much, with the tolerance that it is held to (quaternion component, m).
std::string PoseErrorText(const std::string& link, const FootPoseError& error, double tolerance);
/// By how much the centre of mass is outside of the support polygon.
std::string ComErrorText(double distance_m, double tolerance_m);

}  // namespace legopt

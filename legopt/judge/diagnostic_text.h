#pragma once

#include <string>

#include "legopt/judge/stance_measures.h"

namespace legopt {

/// @file
/// Texts of the judge's findings: numbers with four digits, lengths below a metre in mm.

/// Formats a number.
std::string NumberText(double value);
/// Formats a length given in metres.
std::string LengthText(double value_m);
/// Describes a foot pose error: foot, component, magnitude and tolerance (quaternion component, m).
std::string PoseErrorText(const std::string& link, const ContactPoseError& error, double tolerance);
/// Describes the distance of the centre of mass from the support polygon.
std::string ComErrorText(double distance_m, double tolerance_m);

}  // namespace legopt

#include "legopt/judge/diagnostic_text.h"

#include "legopt/types/number_text.h"

namespace legopt {

std::string NumberText(double value) {
  constexpr int kDigits = 4;
  return FormatGeneral(value, kDigits);
}

std::string LengthText(double value_m) {
  constexpr double kMillimetres = 1000.0;
  return value_m < 1 ? NumberText(value_m * kMillimetres) + " mm" : NumberText(value_m) + " m";
}

std::string PoseErrorText(const std::string& link, const ContactPoseError& error, double tolerance) {
  const std::string axis(1, "xyz"[error.component % 3]);
  if (error.component >= 3) {
    return link + " translation " + axis + " off by " + LengthText(error.violation) + " (tolerance " +
           LengthText(tolerance) + ")";
  }
  return link + " rotation about " + axis + " off by " + NumberText(error.violation) +
         " (quaternion component, tolerance " + NumberText(tolerance) + ", half the angle in rad)";
}

std::string ComErrorText(double distance_m, double tolerance_m) {
  return "centre of mass " + LengthText(distance_m) + " outside the support polygon (tolerance " +
         LengthText(tolerance_m) + ")";
}

}  // namespace legopt

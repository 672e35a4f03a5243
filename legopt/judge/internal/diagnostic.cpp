#include "legopt/judge/internal/diagnostic.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "legopt/judge/internal/touch.h"
#include "legopt/types/check.h"
#include "legopt/types/number_text.h"

namespace legopt {

ContactPoseError ComputeContactPoseError(const Eigen::Isometry3d& target, const Eigen::Isometry3d& actual) {
  const Eigen::Isometry3d error = target.inverse(Eigen::Isometry) * actual;
  Eigen::Matrix<double, 6, 1> components;
  components << Eigen::Quaterniond(error.linear()).normalized().vec(), error.translation();
  ContactPoseError result;
  for (int i = 0; i < components.size(); ++i) {
    const double violation =
        std::isnan(components[i]) ? std::numeric_limits<double>::infinity() : std::abs(components[i]);
    if (violation > result.violation) result = {.violation = violation, .component = i};
  }
  return result;
}

std::vector<ContactPlacement> ActualPlacements(const Dataset& dataset, const Stance& stance,
                                               const Kinematics& kinematics) {
  std::vector<ContactPlacement> placements;
  for (const ContactTarget& target : stance.contacts) {
    const Contact& contact = dataset.contact(target.contact);
    placements.push_back({.contact = &contact, .X_WL = kinematics.link_pose(contact.link_index)});
  }
  return placements;
}

double ComDistance(const std::vector<ContactPlacement>& placements, const Kinematics& kinematics) {
  // Coordinates near the largest double overflow in kinematics.
  const bool finite = kinematics.com().allFinite() && std::ranges::all_of(placements, [](const ContactPlacement& p) {
                        return p.X_WL.matrix().allFinite();
                      });
  if (!finite || placements.empty()) return std::numeric_limits<double>::infinity();
  return SignedDistanceToPolygon(SupportPolygon(placements), kinematics.com().head<2>());
}

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

std::string TouchText(const std::string& contact, double gap_m) {
  constexpr double kPercent = 100.0;
  return contact + " does not touch the scene: " + NumberText(kPercent * kTouchShare) +
         " % of its patch must be within " + LengthText(kTouchTolerance_m) + " of a surface, and are within " +
         (gap_m < kFarGap_m ? LengthText(gap_m) : "more than " + LengthText(kFarGap_m));
}

std::string ComErrorText(double distance_m, double tolerance_m) {
  return "centre of mass " + LengthText(distance_m) + " outside the support polygon (tolerance " +
         LengthText(tolerance_m) + ")";
}

}  // namespace legopt

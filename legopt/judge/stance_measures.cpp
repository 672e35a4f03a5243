#include "legopt/judge/stance_measures.h"

#include <algorithm>
#include <cmath>
#include <limits>

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

}  // namespace legopt

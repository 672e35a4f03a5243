#include "legopt/judge/contact_pose_error.h"

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

}  // namespace legopt

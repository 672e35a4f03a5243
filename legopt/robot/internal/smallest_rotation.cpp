#include "legopt/robot/internal/smallest_rotation.h"

namespace legopt {

Eigen::Quaterniond SmallestRotation(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  return Eigen::Quaterniond::FromTwoVectors(from, to);
}

}  // namespace legopt

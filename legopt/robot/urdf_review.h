#pragma once

#include <string>
#include <vector>

#include "legopt/robot/urdf_check.h"

namespace legopt {

/// Something in a URDF that can be read, but may not be meant. Nothing that RobotModel holds tells of it.
struct UrdfRemark {
  std::string field;    ///< links or joints
  std::string value;    ///< may be empty
  std::string message;  ///< what is odd
  std::string fix;      ///< what the user can do
};

/// Moving joints without `<axis>`, which turn about x, and inertias that no body can have (not positive definite, or
/// one principal moment larger than the sum of the others by more than 1 %). One remark for each kind.
std::vector<UrdfRemark> ReviewUrdf(const CheckedUrdf& urdf);

}  // namespace legopt

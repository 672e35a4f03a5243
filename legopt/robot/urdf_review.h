#pragma once

#include <string>
#include <vector>

#include "legopt/robot/urdf_check.h"

namespace legopt {

/// A valid but suspicious part of a URDF, which RobotModel does not record.
struct UrdfDiagnostic {
  std::string field;    ///< links or joints
  std::string value;    ///< may be empty
  std::string message;  ///< the problem
  std::string fix;      ///< advice to the user
};

/// Finds moving joints without `<axis>`, which rotate about x, and physically impossible inertias (not positive
/// definite, or one principal moment more than 1 % larger than the sum of the others). One remark per kind.
std::vector<UrdfDiagnostic> ReviewUrdf(const CheckedUrdf& urdf);

}  // namespace legopt

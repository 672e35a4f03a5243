#pragma once

#include <Eigen/Core>
#include <string>

namespace legopt {

/// Rotation that turns the up axis of a COLLADA file to z, from its `up_axis` (Y_UP: x stays, y becomes z; X_UP: x
/// becomes z, y becomes -x). The identity for Z_UP, for files without the element and for files of other formats.
/// Throws InputError for any other value of the element.
Eigen::Matrix3d TurnToZUp(const std::string& mesh_file);

}  // namespace legopt

#pragma once

#include <Eigen/Core>
#include <string>

namespace legopt {

/// Returns the rotation that makes z the up axis of a COLLADA file, from its `up_axis` (Y_UP: x unchanged, y becomes z;
/// X_UP: x becomes z, y becomes -x). Identity for Z_UP, for files without the element and for other formats. Throws
/// InputError for any other value of the element.
Eigen::Matrix3d RotationToZUp(const std::string& mesh_file);

}  // namespace legopt

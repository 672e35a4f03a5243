#pragma once

#include <Eigen/Core>
#include <string>

#include "legopt/collision/mesh.h"

namespace legopt {

/// LoadMesh without its protection: assimp reads the file in the calling thread. Damaged files make assimp 5.2 crash,
/// write past its memory or read for ever, so only LoadMesh calls this, under the guard that it was given.
TriangleMesh ReadMesh(const std::string& path, const Eigen::Vector3d& scale);

}  // namespace legopt

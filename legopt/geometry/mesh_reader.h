#pragma once

#include <Eigen/Core>
#include <string>

#include "legopt/geometry/mesh.h"

namespace legopt {

/// Loads a mesh like LoadMesh, but without protection: assimp reads the file in the calling thread. Malformed files
/// make assimp 5.2 crash, write out of bounds or never return, so only LoadMesh calls this, under its guard.
TriangleMesh ReadMesh(const std::string& path, const Eigen::Vector3d& scale);

}  // namespace legopt

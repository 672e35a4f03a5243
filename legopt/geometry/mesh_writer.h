#pragma once

#include <filesystem>

#include "legopt/geometry/mesh.h"

namespace legopt {

/// Writes a binary little-endian PLY with float coordinates. If the first byte would be a line end, which assimp
/// misreads, vertices get an additional property `guard`. Throws InputError if the file cannot be written.
void WritePly(const std::filesystem::path& path, const TriangleMesh& mesh);

}  // namespace legopt

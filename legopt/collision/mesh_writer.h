#pragma once

#include <filesystem>

#include "legopt/collision/mesh.h"

namespace legopt {

/// Writes a binary little-endian PLY with float coordinates; in the rare case that its first byte would be a line end,
/// at which assimp stumbles, vertices also have a property `guard`. Throws InputError when the file cannot be written.
void WritePly(const std::filesystem::path& path, const TriangleMesh& mesh);

}  // namespace legopt

#pragma once

#include <optional>
#include <string>

namespace legopt {

/// Converts an STL file that assimp cannot read: text with upper-case keywords becomes lower case, and bytes after the
/// last triangle of a binary file are removed. Empty if the file needs no change, and for other formats. Throws
/// InputError for a binary file whose number of triangles does not match its size.
std::optional<std::string> RepairStl(const std::string& path);

}  // namespace legopt

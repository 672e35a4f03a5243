#pragma once

#include <optional>
#include <string>

namespace legopt {

/// The content of an STL file in the form that assimp reads, where the file itself is not: text with keywords in
/// capitals becomes lower case, bytes behind the last triangle of a binary file are left out. Empty where the file is
/// fine as it is, and for other formats. Throws InputError for a binary file whose number of triangles does not fit its
/// size.
std::optional<std::string> MendedStl(const std::string& path);

}  // namespace legopt

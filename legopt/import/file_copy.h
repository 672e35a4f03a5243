#pragma once

#include <filesystem>

namespace legopt {

/// Copies a file, making folders on the way. Throws InputError that names `from`.
void CopyFile(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace legopt

#pragma once

#include <filesystem>
#include <string_view>

#include "legopt/files/written_file.h"

namespace legopt {

/// Writes a file atomically with files::ReplaceFile. Throws InputError with file, cause and fix; files::FileError if
/// memory or file descriptors are exhausted.
void WriteOutputFile(const std::filesystem::path& path, std::string_view bytes,
                     const files::WriteOptions& options = {});

/// Copies a file and creates the parent folders of `to`. Throws like WriteOutputFile.
void CopyOutputFile(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace legopt

#pragma once

#include <filesystem>
#include <string_view>

#include "files/written_file.h"

namespace legopt {

/// Writes a file as files::ReplaceFile does: whole or not at all. Throws InputError naming the file, cause and fix;
/// files::FileError where the machine has no memory or descriptors left.
void WriteOutputFile(const std::filesystem::path& path, std::string_view bytes,
                     const files::WriteOptions& options = {});

/// Copies a file, with the folders above `to`. Errors as above.
void CopyOutputFile(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace legopt

#pragma once

#include <filesystem>
#include <string>

namespace legopt::client {

/// Writes a file: a regular file, or none, is replaced in one step, so that nothing is lost when it cannot be
/// written; anything else (a pipe) is written into. Throws ClientError (kUsage) when it cannot be written.
void ReplaceFile(const std::filesystem::path& path, const std::string& text);

}  // namespace legopt::client

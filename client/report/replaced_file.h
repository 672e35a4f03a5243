#pragma once

#include <filesystem>
#include <string>

namespace legopt::client {

/// Writes a file like files::ReplaceFile. Throws ClientError (kUsage) if it cannot be written.
void ReplaceFile(const std::filesystem::path& path, const std::string& text);

}  // namespace legopt::client

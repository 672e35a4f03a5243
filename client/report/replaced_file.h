#pragma once

#include <filesystem>
#include <string>

namespace legopt::client {

/// Writes a file as files::ReplaceFile does. Throws ClientError (kUsage) when it cannot be written.
void ReplaceFile(const std::filesystem::path& path, const std::string& text);

}  // namespace legopt::client

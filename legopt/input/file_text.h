#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace legopt {

/// Reads all bytes of a file, pipe or device, at most `most_bytes`. Reading stops at this limit, so that endless files
/// do not exhaust memory. Throws InputError for a folder, a file that cannot be opened, and a file above the limit;
/// std::system_error if file descriptors or memory are exhausted.
std::string ReadFileText(const std::filesystem::path& path, std::size_t most_bytes);

}  // namespace legopt

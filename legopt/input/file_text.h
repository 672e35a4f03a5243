#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace legopt {

/// Reads all bytes of a file, pipe or device, at most `most_bytes`. Reading stops there, so that endless files cost no
/// more memory. Throws InputError for a folder, a file that cannot be opened, and one that is larger; std::system_error
/// when the process or the machine is out of descriptors or memory.
std::string ReadFileText(const std::filesystem::path& path, std::size_t most_bytes);

}  // namespace legopt

#pragma once

#include <string>
#include <string_view>

namespace legopt {

/// BLAKE2b-256 of the bytes, 64 lower-case hexadecimal digits. Names datasets, files and methods.
std::string Blake2bHex(std::string_view bytes);

/// Whether the text could be one: 64 lower-case hexadecimal digits.
bool IsBlake2bHex(std::string_view text);

}  // namespace legopt

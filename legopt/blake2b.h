#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace legopt {

/// BLAKE2b of the bytes in lower-case hexadecimal digits, two for each byte of the hash: 16 to 64, of which 32 name
/// datasets, files and methods.
std::string Blake2bHex(std::string_view bytes, std::size_t hash_bytes = 32);

/// Bytes as lower-case hexadecimal digits.
std::string HexText(std::span<const unsigned char> bytes);

/// Whether the text could be one: 64 lower-case hexadecimal digits.
bool IsBlake2bHex(std::string_view text);

}  // namespace legopt

#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace legopt {

/// Returns the BLAKE2b hash of the bytes as lower-case hexadecimal digits, two per byte of the hash. `hash_bytes`: 16
/// to 64; identifiers of datasets, files and methods have 32.
std::string Blake2bHex(std::string_view bytes, std::size_t hash_bytes = 32);

/// Returns the bytes as lower-case hexadecimal digits.
std::string HexText(std::span<const unsigned char> bytes);

/// Returns true if the text has the form of a 32-byte hash: 64 lower-case hexadecimal digits.
bool IsBlake2bHex(std::string_view text);

}  // namespace legopt

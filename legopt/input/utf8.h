#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace legopt {

/// A character at the start of a text.
struct Utf8Character {
  char32_t code = 0;      ///< code point
  std::size_t bytes = 0;  ///< length of its encoding; 0: the text does not start with valid UTF-8
};

/// Decodes the first character of a text that is not empty, by RFC 3629: no overlong forms, no surrogates, nothing
/// above U+10FFFF.
Utf8Character FirstCharacter(std::string_view text);

/// Position of the first byte that is not valid UTF-8; npos when there is none.
std::size_t FirstInvalidByte(std::string_view text);

/// Throws InputError for text that is not UTF-8, with line, byte and value of the first invalid byte. `source` names
/// the file, or says where the text comes from.
void RequireUtf8(std::string_view text, const std::string& source);

}  // namespace legopt

#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace legopt {

/// First character of a text.
struct Utf8Character {
  char32_t code = 0;      ///< code point
  std::size_t bytes = 0;  ///< length of its encoding; 0 if the text does not start with valid UTF-8
};

/// Decodes the first character of a non-empty text by RFC 3629: no overlong forms, no surrogates, nothing above
/// U+10FFFF.
Utf8Character FirstCharacter(std::string_view text);

/// Returns the position of the first byte that is not valid UTF-8; npos if there is none.
std::size_t FirstInvalidByte(std::string_view text);

/// Appends the encoding of a code point: at most U+10FFFF, no surrogate.
void AppendUtf8(char32_t code, std::string& text);

/// Converts a text with a byte order mark of UTF-16 or UTF-32 to UTF-8; returns other texts unchanged. Throws
/// InputError for a text with such a mark that is invalid in its encoding. `source`: file name, or a description of the
/// text's origin.
std::string FromMarkedEncoding(std::string text, const std::string& source);

/// Throws InputError for a text that is not UTF-8, with line, byte and value of the first invalid byte. `source`: file
/// name, or a description of the text's origin.
void RequireUtf8(std::string_view text, const std::string& source);

}  // namespace legopt

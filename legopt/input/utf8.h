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

/// Appends the encoding of a code point, which is at most U+10FFFF and no surrogate.
void AppendUtf8(char32_t code, std::string& text);

/// The text in UTF-8 if it begins with a byte order mark of UTF-16 or UTF-32, else unchanged. Throws InputError for
/// text with such a mark that is not valid in that encoding. `source` as below.
std::string FromMarkedEncoding(std::string text, const std::string& source);

/// Throws InputError for text that is not UTF-8, with line, byte and value of the first invalid byte. `source` names
/// the file, or says where the text comes from.
void RequireUtf8(std::string_view text, const std::string& source);

}  // namespace legopt

#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace legopt {

/// Reads all bytes of a file, pipe or device, at most `most_bytes`. Reading stops at this limit, so that endless files
/// do not exhaust memory. Throws InputError for a folder, a file that cannot be opened, and a file above the limit;
/// std::system_error if file descriptors or memory are exhausted.
/// Throws InputError for pointers of Git LFS and git-annex as well.
std::string ReadFileText(const std::filesystem::path& path, std::size_t most_bytes);

/// Throws InputError if a file starts like a pointer of Git LFS or git-annex, which a clone without large files has in
/// place of them.
void RefusePointer(std::string_view start, const std::filesystem::path& path);

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

/// Reason why a text is not a valid name.
struct NameDiagnostic {
  std::string message;  ///< the violated rule
  std::string fix;      ///< advice to the user
};

/// Checks a name of an experiment, method, tag, dataset or submitter, so that names that look the same are the same. A
/// valid name is UTF-8 in composed form (NFC) and not empty. It does not begin or end with a blank, and contains no
/// control character, no invisible or bidirectional formatting character and no blank other than U+0020. Returns no
/// fault for a valid name.
std::optional<NameDiagnostic> DiagnoseName(std::string_view name);

/// Throws InputError for an invalid name; `file` and `field` are its location.
void RequireName(std::string_view name, const std::string& file, const std::string& field);

/// Converts a text to composed form (NFC), for names taken from file names, which some systems store decomposed. Text
/// that is not UTF-8 is returned unchanged.
std::string ToNfc(std::string_view text);

}  // namespace legopt

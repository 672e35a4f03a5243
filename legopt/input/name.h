#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace legopt {

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

#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace legopt {

/// Why a text cannot be a name.
struct NameFault {
  std::string message;  ///< the rule that it breaks
  std::string fix;      ///< advice to the user
};

/// The one rule for names of experiments, methods, tags, datasets and submitters: names that look the same are the
/// same. A name is UTF-8 in composed form (NFC) and not empty, does not begin or end with a blank, and holds no control
/// character, no invisible or bidirectional formatting character and no blank other than U+0020. Empty when `name`
/// keeps the rule.
std::optional<NameFault> FindNameFault(std::string_view name);

/// Throws InputError for a text that cannot be a name; `file` and `field` say where it stands.
void RequireName(std::string_view name, const std::string& file, const std::string& field);

/// The text in composed form (NFC), for names taken from a file's name, which some systems store decomposed. Text that
/// is not UTF-8 is returned unchanged.
std::string Composed(std::string_view text);

}  // namespace legopt

#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace legopt::app {

/// Returns true for a text that is one value although it contains commas: an existing file, a known name.
using IsWholeValue = std::function<bool(const std::string& text)>;

/// Splits values separated by commas. The longest run of parts that `is_whole` accepts is one value; otherwise each
/// part is one, without blanks at its ends. "\," is a comma inside a value.
///
///     "a,b"        a and b, or "a,b" if that is a whole value
///     "a\,b,c"     "a,b" and c
std::vector<std::string> SplitValues(std::string_view text, const IsWholeValue& is_whole = {});

/// Returns whether a file or folder of that name exists. For lists of paths.
bool IsExistingPath(const std::string& text);

}  // namespace legopt::app

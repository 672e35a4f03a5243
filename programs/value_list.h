#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace legopt::programs {

/// True for a text that is one value though it holds commas: a file that exists, a known name.
using IsWholeValue = std::function<bool(const std::string& text)>;

/// Values that are written with commas between them. The longest run of parts that `is_whole` accepts is one value;
/// otherwise each part is, without blanks at its ends. "\," is a comma inside of a value.
///
///     "a,b"        a and b, or "a,b" if that is a whole value
///     "a\,b,c"     "a,b" and c
std::vector<std::string> SplitValues(std::string_view text, const IsWholeValue& is_whole = {});

/// For lists of paths: whether a file or folder of that name exists.
bool IsExistingPath(const std::string& text);

}  // namespace legopt::programs

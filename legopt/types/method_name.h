#pragma once

#include <algorithm>
#include <cctype>
#include <string_view>

namespace legopt {

/// Suffix of the names of methods with an external solver.
inline constexpr char kExternalMark[] = " (external)";

/// Returns whether `wanted`, as typed by a user, names the method `name`. Ignores case; the suffix for external solvers
/// is optional.
inline bool IsMethodName(std::string_view name, std::string_view wanted) {
  const auto equal = [](char a, char b) {
    return std::tolower(static_cast<unsigned char>(a)) == std::tolower(static_cast<unsigned char>(b));
  };
  const auto same = [&equal](std::string_view a, std::string_view b) {
    return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), equal);
  };
  const std::string_view mark = kExternalMark;
  return same(name, wanted) || (name.ends_with(mark) && same(name.substr(0, name.size() - mark.size()), wanted));
}

}  // namespace legopt

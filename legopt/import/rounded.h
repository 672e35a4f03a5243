#pragma once

#include <array>
#include <cstdio>
#include <string>

namespace legopt {

/// A number of a finding, as people read it. `format`: one of std::printf for a double.
inline std::string Rounded(const char* format, double value) {
  std::array<char, 48> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

}  // namespace legopt

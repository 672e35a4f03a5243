#pragma once

#include <array>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <string>

namespace legopt {

/// An invariant as text, with the source location of the check.
struct Invariant {
  /// Implicit, so that a string literal converts. The folder is removed at compile time, so that binaries contain no
  /// paths of the build machine.
  // NOLINTNEXTLINE(google-explicit-constructor): as it says
  consteval Invariant(const char* text_in, const char* path = __builtin_FILE(), int line_in = __builtin_LINE())
      : text(text_in), line(line_in) {
    const char* name = path;
    for (const char* c = path; *c != '\0'; ++c) {
      if (*c == '/') name = c + 1;
    }
    for (std::size_t i = 0; name[i] != '\0' && i + 1 < file.size(); ++i) file[i] = name[i];
  }

  const char* text;  ///< the invariant in words
  int line;
  std::array<char, 48> file{};  ///< file name without its folder, cut to 47 bytes
};

/// Aborts the program if an internal invariant is broken. Bad input is an InputError and a numerical failure is a
/// status; neither belongs here. The message on standard error contains `values`, which need an operator<<:
///
///     legopt: broken invariant: joints stand depth first (got 'atlas', '3') [robot_model.cpp:21]
///
/// Thread-safe. Costs one comparison if the invariant holds.
template <class... Values>
void CheckInvariant(bool holds, Invariant invariant, const Values&... values) {
  if (holds) [[likely]] {
    return;
  }
  std::ostringstream shown;
  [[maybe_unused]] const char* separator = " (got '";
  ((shown << separator << values << "'", separator = ", '"), ...);
  if (sizeof...(values) > 0) shown << ")";
  std::fprintf(stderr, "legopt: broken invariant: %s%s [%s:%d]\n", invariant.text, shown.str().c_str(),
               invariant.file.data(), invariant.line);
  std::abort();
}

}  // namespace legopt

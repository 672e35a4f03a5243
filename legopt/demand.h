#pragma once

#include <array>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <string>

namespace legopt {

/// What must hold, said at the call: the text and where it stands.
struct Invariant {
  /// Implicit, so that a literal is one. The folder is left out at compile time: no program holds a path of its build.
  // NOLINTNEXTLINE(google-explicit-constructor): as it says
  consteval Invariant(const char* text_in, const char* path = __builtin_FILE(), int line_in = __builtin_LINE())
      : text(text_in), line(line_in) {
    const char* name = path;
    for (const char* c = path; *c != '\0'; ++c) {
      if (*c == '/') name = c + 1;
    }
    for (std::size_t i = 0; name[i] != '\0' && i + 1 < file.size(); ++i) file[i] = name[i];
  }

  const char* text;             ///< of the source: what must hold
  int line;                     ///< of the call
  std::array<char, 48> file{};  ///< name without its folder, cut to 47 bytes
};

/// Ends the program when an invariant of ours is broken: neither bad input (an InputError) nor a numerical outcome (a
/// status). Shows it with the values that tell why, on standard error:
///
///     legopt: broken invariant: joints stand depth first (got 'atlas', '3') [robot_model.cpp:21]
///
/// Values need an operator<<. Thread-safe; costs one comparison where it holds.
template <class... Values>
void Demand(bool holds, Invariant invariant, const Values&... values) {
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

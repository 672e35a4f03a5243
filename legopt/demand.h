#pragma once

#include <cstdio>
#include <cstdlib>
#include <source_location>
#include <sstream>
#include <string>

namespace legopt {

/// What must hold, said at the call: the text and where it stands.
struct Invariant {
  // Implicit, so that a literal is one.
  consteval Invariant(const char* text_in, std::source_location place_in = std::source_location::current())
      : text(text_in), place(place_in) {}

  const char* text;
  std::source_location place;
};

/// Ends the program when an invariant of ours is broken: neither bad input (an InputError) nor a numerical outcome (a
/// status). Shows it with the values that tell why, on standard error:
///
///     legopt: broken invariant: joints stand depth first (got 'atlas', '3') [legopt/robot/robot_model.cpp:21]
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
  std::fprintf(stderr, "legopt: broken invariant: %s%s [%s:%u]\n", invariant.text, shown.str().c_str(),
               invariant.place.file_name(), static_cast<unsigned>(invariant.place.line()));
  std::abort();
}

}  // namespace legopt

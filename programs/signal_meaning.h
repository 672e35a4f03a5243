#pragma once

#include <string>

namespace legopt::programs {

/// Returns the name and meaning of a signal that ended a process: "SIGKILL (killed from outside, perhaps because the
/// machine ran out of memory)". Thread-safe.
std::string SignalMeaning(int signal);

}  // namespace legopt::programs

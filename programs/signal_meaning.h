#pragma once

#include <string>

namespace legopt::programs {

/// A signal that ended a process, with its meaning: "SIGKILL (killed from outside, perhaps because the machine ran out
/// of memory)". Thread-safe.
std::string SignalMeaning(int signal);

}  // namespace legopt::programs

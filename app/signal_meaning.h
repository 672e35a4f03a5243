#pragma once

#include <string>

namespace legopt::app {

/// Returns the name and meaning of a signal that ended a process: "SIGKILL (killed from outside, perhaps because the
/// machine ran out of memory)", "SIGRTMIN+3 (real-time signal)". Thread-safe.
std::string SignalMeaning(int signal);

/// An exit code: "exit code 3", and for 128 + N, with which shells and wrapper scripts report that signal N ended their
/// program, also the signal's meaning. Thread-safe.
std::string ExitCodeMeaning(int code);

}  // namespace legopt::app

#pragma once

#include <string>

namespace legopt::app {

/// Returns a text as a word of a POSIX shell's command line: unchanged if possible, otherwise in single quotes.
std::string ShellWord(const std::string& text);

}  // namespace legopt::app

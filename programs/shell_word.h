#pragma once

#include <string>

namespace legopt::programs {

/// A text as a word of a POSIX shell's command line: as it stands where the shell takes it so, else in single quotes.
std::string ShellWord(const std::string& text);

}  // namespace legopt::programs

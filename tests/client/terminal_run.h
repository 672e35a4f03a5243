#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "program_run.h"

namespace legopt::client {

struct TerminalSize {
  unsigned short columns = 80;
  unsigned short lines = 24;
};

/// Returns whether this system has pseudo-terminals; a bare chroot does not.
bool HasTerminals();

/// Runs a program until it ends, with a new terminal as standard input, output and error. `out` of the result is
/// everything written to the terminal, with plain line ends; `err` is empty. `environment` is added to that of this
/// process, without its variables for terminals (COLUMNS, PAGER, NO_COLOR, ...). An empty value removes a variable.
/// `typed`: text that is typed at once.
ProgramResult RunInTerminal(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                            const std::filesystem::path& folder, const TerminalSize& size,
                            const std::map<std::string, std::string>& environment = {}, const std::string& typed = "");

}  // namespace legopt::client

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

/// Whether this system has pseudo-terminals; a bare chroot does not.
bool HasTerminals();

/// Runs a program with a terminal of its own as standard input, output and error until it ends. `out` of the result is
/// all that the terminal got, with plain line ends; `err` is empty. `environment` is added to ours, from which what
/// concerns terminals (COLUMNS, PAGER, NO_COLOR, ...) is taken away; an empty value removes a variable.
ProgramResult RunInTerminal(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                            const std::filesystem::path& folder, const TerminalSize& size,
                            const std::map<std::string, std::string>& environment = {});

}  // namespace legopt::client

#pragma once

#include <optional>
#include <span>
#include <string>

#include "legopt/input_error.h"

namespace legopt::programs {

class Program;

/// A word that people type for a command, and the command's name here. For suggestions only; it runs nothing.
struct Synonym {
  const char* typed;
  const char* command;
};

/// Reads a command line into the variables that the options are bound to. Empty: the program goes on. Otherwise all is
/// said and the value is the exit status:
/// * 0: help or version were asked for, by --help, --version, "help [COMMAND]" or "version"; they are on standard
/// output;
/// * 2: wrong usage. One line "PROGRAM: error: CAUSE; see 'PROGRAM COMMAND --help'" is on standard error; the cause
/// names
///   the nearest command or option where one is unknown (a command also by what others call it). Where a command is
///   missing altogether ("legopt", "legopt dataset") the help is on standard output instead.
///
/// Commands are found by name wherever there are some; options before a command take no value. Output that cannot
/// be written is wrong usage, too.
std::optional<int> ParseCommandLine(const Program& program, int argc, const char* const* argv,
                                    std::span<const Synonym> synonyms = {});

/// "PROGRAM: error: MESSAGE" as one line on standard error, with the message made printable; standard output is flushed
/// before.
void ReportError(const std::string& program, const std::string& message);
/// A line for each fault.
void ReportError(const std::string& program, const InputError& error);

}  // namespace legopt::programs

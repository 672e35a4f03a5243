#pragma once

#include <optional>
#include <span>
#include <string>

#include "legopt/types/input_error.h"

namespace legopt::app {

class Program;

/// Returns the reference of a program's command line in Markdown, made from the definition of its options: its commands
/// by group, each with usage, arguments and options, and at the end the network options, described once. Hidden
/// commands and options are omitted. The text does not depend on the machine.
std::string CommandReference(const Program& program);

class Program;

/// Alternative name of a command, or name that it had in an earlier version. Only for the error message; it does not
/// run the command.
struct Synonym {
  const char* typed;
  const char* command;  ///< name of a command; or a whole command line, e.g. "pause --now"
};

/// Reads a command line into the variables of the options. Returns nothing if the program should continue. Otherwise it
/// has printed everything, and the returned value is the exit status:
/// * 0: help or version was requested and is on standard output: by --help, --version, "help [COMMAND]" or "version".
///   --help omits the options under kNetworkHeading, --help-network prints only these. "help --markdown" prints
///   CommandReference;
/// * 2: wrong usage. One line "PROGRAM: error: CAUSE; see 'PROGRAM COMMAND --help'" is on standard error. The cause
///   names the nearest command or option if one is unknown, or the synonym of the command. If a command is
///   missing altogether ("legopt", "legopt dataset"), the help is on standard output instead.
///
/// Commands are recognised by their names; options before a command take no value. Output that cannot be written is
/// also wrong usage.
std::optional<int> ParseCommandLine(const Program& program, int argc, const char* const* argv,
                                    std::span<const Synonym> synonyms = {});

/// Prints "PROGRAM: error: MESSAGE" as one line to standard error, with the message made printable. Flushes standard
/// output first.
void ReportError(const std::string& program, const std::string& message);
/// Prints one line for each fault.
void ReportError(const std::string& program, const InputError& error);

}  // namespace legopt::app

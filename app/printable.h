#pragma once

#include <string>
#include <string_view>

namespace legopt::app {

/// Returns a text as a word of a POSIX shell's command line: unchanged if possible, otherwise in single quotes.
std::string ShellWord(const std::string& text);

/// Returns untrusted text (names, reasons, messages, SQL results, log lines) in a form that is safe to print on a
/// terminal. UTF-8 is kept. Characters that a terminal might interpret, or that hide or reorder other text, become
/// visible escapes:
///
///     newline, tab, carriage return                           \n \t \r
///     other C0 controls (ESC, BEL, ...), DEL, broken UTF-8    \x1b, of each byte
///     C1 controls, line and paragraph separators,
///     directional marks and overrides, invisible spaces       \u009b, \u202e
///
/// The result is one line. Backslashes in the text are not escaped: the output is for reading, not for parsing.
/// Thread-safe.
std::string Printable(std::string_view text);

/// Returns a text of several lines, e.g. the end of a log, in printable form: newlines stay, carriage returns before
/// them are removed, tabs become spaces.
std::string PrintableLines(std::string_view text);

/// Returns a text of unchanged length for storing or sending: control characters except newline and tab, and DEL,
/// become '?'. Invalid UTF-8 stays (the bus replaces it).
std::string WithoutControls(std::string_view text);

/// Returns a JSON text with the same characters escaped in JSON's syntax (\u0085, \ud83e\udd16); its value does not
/// change. Invalid UTF-8 stays.
std::string PrintableJson(std::string_view json);

}  // namespace legopt::app

#pragma once

#include <string>
#include <string_view>

namespace legopt::programs {

/// A text of whatever origin (names, reasons, messages, SQL results, log lines) as it may be sent to a terminal: UTF-8
/// stays, what a terminal could act on or what would hide or reorder other text becomes a visible escape:
///
///     newline, tab, carriage return                           \n \t \r
///     other C0 controls (ESC, BEL, ...), DEL, broken UTF-8    \x1b, of each byte
///     C1 controls, line and paragraph separators,
///     directional marks and overrides, invisible spaces       \u009b, \u202e
///
/// The result is one line. Backslashes of the text itself stay as they are: what is printed is for eyes, not for
/// reading back. Thread-safe.
std::string Printable(std::string_view text);

/// The same for a text of several lines, e.g. the end of a log: newlines stay, carriage returns before them go, a tab
/// becomes a space.
std::string PrintableLines(std::string_view text);

/// A text that is kept or sent on, of unchanged length: controls other than newline and tab, and DEL, become '?'.
/// Broken UTF-8 stays (the bus mends it).
std::string WithoutControls(std::string_view text);

/// A JSON text with the same characters escaped as JSON escapes them (\u0085, \ud83e\udd16); its value does not change.
/// What is no UTF-8 stays.
std::string PrintableJson(std::string_view json);

}  // namespace legopt::programs

#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>

#include "client/report/text_layout.h"

namespace legopt::client {

enum class ColorChoice { kAuto, kAlways, kNever };

/// What the user says about text on standard output.
struct OutputOptions {
  std::optional<std::size_t> width;        ///< --width; default: the terminal's, else no limit
  ColorChoice color = ColorChoice::kAuto;  ///< --color
  bool no_pager = false;                   ///< --no-pager
};

/// What standard output is.
struct Terminal {
  bool is_terminal = false;
  std::size_t columns = 0;  ///< 0: not known
  std::size_t lines = 0;    ///< 0: not known
};

/// Standard output as the kernel describes it.
Terminal StandardOutput();

/// Value of an environment variable; null when it is not set.
using Environment = std::function<const char*(const char* name)>;

/// How to lay out text for `terminal`.
/// * width: --width; else on a terminal COLUMNS, its own columns or 80; else no limit;
/// * color: as --color says; `auto` is on a terminal whose TERM is not "dumb", and never with NO_COLOR (not empty).
TextLayout ChooseLayout(const OutputOptions& options, const Terminal& terminal, const Environment& environment);

/// The same for this process.
TextLayout LayoutOf(const OutputOptions& options);

/// CSV for `terminal`: data as it is, but where people see it, with everything escaped that the terminal could act on.
std::string CsvFor(const Terminal& terminal, const std::string& csv);

/// Writes `text` to standard output; on a terminal that is too low for it through the pager (see pager.h). A reader
/// that has gone ends the process as SIGPIPE does; any other fault is left in std::cout.
void Print(const std::string& text, const OutputOptions& options);

}  // namespace legopt::client

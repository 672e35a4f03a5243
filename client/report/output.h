#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "client/report/text_layout.h"

namespace legopt::client {

enum class ColorChoice { kAuto, kAlways, kNever };

/// The user's options for text on standard output.
struct OutputOptions {
  std::optional<std::size_t> width;  ///< --width; default: the terminal's width, else no limit
  ColorChoice color = ColorChoice::kAuto;
  bool no_pager = false;
};

/// Properties of standard output.
struct Terminal {
  bool is_terminal = false;
  std::size_t columns = 0;  ///< 0: unknown
  std::size_t lines = 0;    ///< 0: unknown
};

/// Standard output as described by the kernel.
Terminal StandardOutput();

/// Returns the value of an environment variable; nullptr if it is not set.
using Environment = std::function<const char*(const char* name)>;

/// Chooses the layout of text for `terminal`:
/// * width: --width; else on a terminal COLUMNS, its own width or 80; else no limit;
/// * color: by --color; `auto` is on for a terminal whose TERM is not "dumb", unless NO_COLOR is set (not empty).
TextLayout ChooseLayout(const OutputOptions& options, const Terminal& terminal, const Environment& environment);

/// Chooses the layout for the standard output of this process.
TextLayout LayoutOf(const OutputOptions& options);

/// Returns CSV for `terminal`: unchanged, but with terminal control characters escaped if it is a terminal.
std::string CsvFor(const Terminal& terminal, const std::string& csv);

/// Writes `text` to standard output, through the pager if it does not fit on a terminal (see output.h).
void Print(const std::string& text, const OutputOptions& options);

/// Writes "legopt: TEXT" to standard error, with terminal control characters escaped.
void PrintRemark(const std::string& text);

/// Returns the command line of the user's pager: LEGOPT_PAGER, else PAGER, else "less -FRX". Empty (no pager) if the
/// value is empty or "cat".
std::string ChoosePager(const Environment& environment);

/// Passes `text` to `command`, run by the shell with this process's standard output, and waits for its end; LESS is set
/// to FRX if the user has not set it. A pager that ends before reading everything is not an error. Returns false,
/// having shown nothing, if there is no command or it cannot be run. Thread rule: modifies the process's SIGPIPE,
/// SIGINT and SIGQUIT during the call, so no other thread may.
bool ShowInPager(const std::string& text, const std::string& command);

/// Writes a file like files::ReplaceFile. Throws ClientError (kUsage) if it cannot be written.
void ReplaceFile(const std::filesystem::path& path, const std::string& text);

}  // namespace legopt::client

#include "client/report/terminal.h"

#include <signal.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <iostream>
#include <string_view>

#include "app/printable.h"
#include "client/report/pager.h"

namespace legopt::client {
namespace {

constexpr std::size_t kUsualColumns = 80;

const char* OwnEnvironment(const char* name) { return std::getenv(name); }

std::string_view TextOf(const char* value) { return value == nullptr ? std::string_view() : std::string_view(value); }

std::size_t TerminalColumns(const Terminal& terminal, const Environment& environment) {
  const std::string_view text = TextOf(environment("COLUMNS"));
  std::size_t columns = 0;
  const auto parsed = std::from_chars(text.data(), text.data() + text.size(), columns);
  if (parsed.ec == std::errc() && parsed.ptr == text.data() + text.size() && columns > 0) return columns;
  return terminal.columns > 0 ? terminal.columns : kUsualColumns;
}

bool UsesColor(ColorChoice choice, const Terminal& terminal, const Environment& environment) {
  if (choice != ColorChoice::kAuto) return choice == ColorChoice::kAlways;
  return terminal.is_terminal && TextOf(environment("NO_COLOR")).empty() && TextOf(environment("TERM")) != "dumb";
}

// Returns the number of lines of `text` on a terminal, which wraps long lines. Escapes are counted as text: at worst
// the pager is started and finds that it is not needed.
std::size_t LinesOn(const Terminal& terminal, std::string_view text) {
  const std::size_t columns = std::max<std::size_t>(terminal.columns, 1);
  std::size_t lines = 0;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    lines += std::max<std::size_t>((DisplayWidth(text.substr(0, end)) + columns - 1) / columns, 1);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return lines;
}

// Ends the process when the reader, e.g. `head`, has closed the pipe. Usually SIGPIPE does this; the signal may be
// ignored if the parent process ignored it.
void RaiseSigpipe() {
  ::signal(SIGPIPE, SIG_DFL);
  ::raise(SIGPIPE);
}

}  // namespace

Terminal StandardOutput() {
  Terminal terminal;
  terminal.is_terminal = ::isatty(STDOUT_FILENO) == 1;
  winsize size{};
  if (terminal.is_terminal && ::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0) {
    terminal.columns = size.ws_col;
    terminal.lines = size.ws_row;
  }
  return terminal;
}

TextLayout ChooseLayout(const OutputOptions& options, const Terminal& terminal, const Environment& environment) {
  TextLayout layout;
  if (options.width) {
    layout.width = *options.width;
  } else if (terminal.is_terminal) {
    layout.width = std::max(TerminalColumns(terminal, environment), kSmallestWidth);
  }
  layout.color = UsesColor(options.color, terminal, environment);
  return layout;
}

TextLayout LayoutOf(const OutputOptions& options) { return ChooseLayout(options, StandardOutput(), OwnEnvironment); }

std::string CsvFor(const Terminal& terminal, const std::string& csv) {
  return terminal.is_terminal ? app::PrintableLines(csv) : csv;
}

void Print(const std::string& text, const OutputOptions& options) {
  const Terminal terminal = StandardOutput();
  const bool too_long = terminal.is_terminal && terminal.lines > 0 && LinesOn(terminal, text) >= terminal.lines;
  if (too_long && !options.no_pager && ShowInPager(text, ChoosePager(OwnEnvironment))) return;
  errno = 0;
  std::cout << text << std::flush;
  if (!std::cout && errno == EPIPE) RaiseSigpipe();
}

}  // namespace legopt::client

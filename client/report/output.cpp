#include "client/report/output.h"

#include <signal.h>
#include <spawn.h>
#include <sys/ioctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <iostream>
#include <optional>
#include <string_view>
#include <vector>

#include "app/printable.h"
#include "app/processes.h"
#include "app/program_main.h"
#include "client/client_error.h"
#include "legopt/files/written_file.h"

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

void PrintRemark(const std::string& text) { std::cerr << "legopt: " << app::Printable(text) << "\n"; }

void Print(const std::string& text, const OutputOptions& options) {
  const Terminal terminal = StandardOutput();
  const bool too_long = terminal.is_terminal && terminal.lines > 0 && LinesOn(terminal, text) >= terminal.lines;
  if (too_long && !options.no_pager && ShowInPager(text, ChoosePager(OwnEnvironment))) return;
  std::cout << text << std::flush;
}

namespace {

constexpr char kUsualPager[] = "less -FRX";
constexpr std::array<int, 3> kSignals = {SIGPIPE, SIGINT, SIGQUIT};

// While the pager runs, an early end of the pager must not kill this process, and keys such as Ctrl-C belong to it.
class PagerSignalGuard {
 public:
  PagerSignalGuard() {
    struct sigaction ignore {};
    ignore.sa_handler = SIG_IGN;
    for (std::size_t i = 0; i < kSignals.size(); ++i) ::sigaction(kSignals[i], &ignore, &previous_[i]);
  }
  ~PagerSignalGuard() {
    for (std::size_t i = 0; i < kSignals.size(); ++i) ::sigaction(kSignals[i], &previous_[i], nullptr);
  }
  PagerSignalGuard(const PagerSignalGuard&) = delete;
  PagerSignalGuard& operator=(const PagerSignalGuard&) = delete;

 private:
  std::array<struct sigaction, kSignals.size()> previous_{};
};

std::vector<std::string> PagerEnvironment() {
  std::vector<std::string> environment;
  for (char** entry = environ; *entry != nullptr; ++entry) environment.emplace_back(*entry);
  if (std::getenv("LESS") == nullptr) environment.emplace_back("LESS=FRX");
  return environment;
}

// Starts the pager with `input` as its standard input; returns -1 on failure.
pid_t Start(const std::string& command, int input) {
  std::vector<std::string> words = {"/bin/sh", "-c", command};
  if (command == kUsualPager)
    words = {"less", "-FRX"};  // without a shell, which would print an error if less is
                               // missing
  std::vector<std::string> environment = PagerEnvironment();
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_adddup2(&actions, input, STDIN_FILENO);
  posix_spawnattr_t attributes;
  ::posix_spawnattr_init(&attributes);
  sigset_t usual;
  ::sigemptyset(&usual);
  for (const int number : kSignals) ::sigaddset(&usual, number);
  ::sigaddset(&usual, SIGXFSZ);  // ignored only in legopt's programs
  ::posix_spawnattr_setsigdefault(&attributes, &usual);
  ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF);
  pid_t pid = -1;
  if (::posix_spawnp(&pid, words.front().c_str(), &actions, &attributes, app::Pointers(words).data(),
                     app::Pointers(environment).data()) != 0) {
    pid = -1;
  }
  ::posix_spawnattr_destroy(&attributes);
  ::posix_spawn_file_actions_destroy(&actions);
  return pid;
}

void WriteAll(int descriptor, const std::string& text) {
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t count = ::write(descriptor, text.data() + done, text.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return;  // the reader has closed the pipe
    done += static_cast<std::size_t>(count);
  }
}

// Returns whether the pager ran: the shell returns 126 and 127 for a command that it cannot run or find.
bool WaitForPager(pid_t pid) {
  constexpr int kNotExecutable = 126, kNotFound = 127;
  const int status = app::WaitForEnd(pid).value_or(0);
  return !WIFEXITED(status) || (WEXITSTATUS(status) != kNotExecutable && WEXITSTATUS(status) != kNotFound);
}

}  // namespace

std::string ChoosePager(const Environment& environment) {
  for (const char* name : {"LEGOPT_PAGER", "PAGER"}) {
    const char* const value = environment(name);
    if (value != nullptr) return std::string(value) == "cat" ? "" : value;
  }
  return kUsualPager;
}

bool ShowInPager(const std::string& text, const std::string& command) {
  if (command.empty()) return false;
  std::optional<app::Pipe> pipe = app::MakePipe();
  if (!pipe) return false;
  std::cout.flush();
  const PagerSignalGuard signals;
  const pid_t pid = Start(command, pipe->read.get());
  pipe->read.Close();
  if (pid > 0) WriteAll(pipe->write.get(), text);
  pipe->write.Close();
  return pid > 0 && WaitForPager(pid);
}

void ReplaceFile(const std::filesystem::path& path, const std::string& text) {
  try {
    files::ReplaceFile(path, text);
  } catch (const files::FileError& error) {
    if (error.error() == EPIPE) throw app::ReaderGone();
    throw ClientError(error.shortage() ? ExitCode::kMachine : ExitCode::kUsage, error.what());
  }
}

}  // namespace legopt::client

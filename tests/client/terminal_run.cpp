#include "terminal_run.h"

#include <pty.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <stdexcept>

namespace legopt::client {
namespace {

void SetTerminalEnvironment(const std::map<std::string, std::string>& environment) {
  for (const char* name : {"COLUMNS", "LINES", "NO_COLOR", "PAGER", "LEGOPT_PAGER", "LESS"}) ::unsetenv(name);
  ::setenv("TERM", "xterm", 1);
  for (const auto& [name, value] : environment) {
    if (value.empty()) {
      ::unsetenv(name.c_str());
    } else {
      ::setenv(name.c_str(), value.c_str(), 1);
    }
  }
}

std::string ReadAll(int terminal) {
  std::string text;
  std::array<char, 4096> buffer{};
  for (;;) {
    const ssize_t count = ::read(terminal, buffer.data(), buffer.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) break;  // EIO: the other side is closed
    text.append(buffer.data(), static_cast<std::size_t>(count));
  }
  std::erase(text, '\r');
  return text;
}

}  // namespace

bool HasTerminals() {
  int terminal = -1, side = -1;
  if (::openpty(&terminal, &side, nullptr, nullptr, nullptr) != 0) return false;
  ::close(terminal);
  ::close(side);
  return true;
}

ProgramResult RunInTerminal(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                            const std::filesystem::path& folder, const TerminalSize& size,
                            const std::map<std::string, std::string>& environment, const std::string& typed) {
  std::vector<std::string> texts = {program.string()};
  texts.insert(texts.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (auto& text : texts) argv.push_back(text.data());
  argv.push_back(nullptr);
  winsize window{};
  window.ws_col = size.columns;
  window.ws_row = size.lines;
  int terminal = -1;
  const pid_t pid = ::forkpty(&terminal, nullptr, nullptr, &window);
  if (pid < 0) throw std::runtime_error("no terminal");
  if (pid == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    SetTerminalEnvironment(environment);
    if (::chdir(folder.c_str()) != 0) ::_exit(99);
    ::execv(argv[0], argv.data());
    ::_exit(99);
  }
  if (!typed.empty() && ::write(terminal, typed.data(), typed.size()) < 0) throw std::runtime_error("cannot type");
  ProgramResult result;
  result.out = ReadAll(terminal);
  int status = 0;
  ::waitpid(pid, &status, 0);
  ::close(terminal);
  result.exit_code = WIFSIGNALED(status) ? kSignalBase + WTERMSIG(status) : WEXITSTATUS(status);
  return result;
}

}  // namespace legopt::client

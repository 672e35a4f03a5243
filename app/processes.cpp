#include "app/processes.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/auxv.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <string>
#include <system_error>
#include <vector>

#include "legopt/types/number_text.h"

namespace legopt::app {

std::string SignalMeaning(int signal) {
  switch (signal) {
    case SIGSEGV:
      return "SIGSEGV (segmentation fault)";
    case SIGABRT:
      return "SIGABRT (aborted)";
    case SIGBUS:
      return "SIGBUS (bus error)";
    case SIGFPE:
      return "SIGFPE (arithmetic error)";
    case SIGILL:
      return "SIGILL (illegal instruction)";
    case SIGKILL:
      return "SIGKILL (killed from outside, perhaps because the machine ran out of memory)";
    case SIGTERM:
      return "SIGTERM (terminated from outside)";
    case SIGINT:
      return "SIGINT (interrupted from outside)";
    case SIGHUP:
      return "SIGHUP (terminal or session closed)";
    case SIGPIPE:
      return "SIGPIPE (the reader of its output has gone)";
    case SIGSYS:
      return "SIGSYS (forbidden system call)";
    case SIGXCPU:
      return "SIGXCPU (processor time limit, 'ulimit -t')";
    case SIGXFSZ:
      return "SIGXFSZ (file size limit, 'ulimit -f')";
    default:
      break;
  }
  if (signal >= SIGRTMIN && signal <= SIGRTMAX) {
    return "SIGRTMIN+" + std::to_string(signal - SIGRTMIN) + " (real-time signal)";
  }
  const char* const name = ::sigabbrev_np(signal);
  if (name == nullptr) return "SIG" + std::to_string(signal) + " (a signal without a name)";
  return std::string("SIG") + name + " (" + ::sigdescr_np(signal) + ")";
}

std::string ExitCodeMeaning(int code) {
  constexpr int kShellAdds = 128;
  const std::string text = "exit code " + std::to_string(code);
  const int signal = code - kShellAdds;
  if (signal < 1 || signal > SIGRTMAX) return text;
  return text + ", with which a shell reports " + SignalMeaning(signal);
}

void Descriptor::Close() {
  if (fd_ >= 0) ::close(Take());
}

void Descriptor::SetNonBlocking() const { ::fcntl(fd_, F_SETFL, O_NONBLOCK); }

bool IsExecutable(const std::filesystem::path& file) {
  std::error_code ignored;
  return std::filesystem::is_regular_file(file, ignored) && ::access(file.c_str(), X_OK) == 0;
}

std::string MissingNullDevice() {
  if (::access("/dev/null", R_OK | W_OK) == 0) return {};
  return " without /dev/null (create it: 'mknod -m 666 /dev/null c 1 3')";
}

std::filesystem::path FindProgram(const std::string& name) {
  const char* variable = std::getenv("PATH");
  ClassicInput folders(variable == nullptr ? "" : variable);
  for (std::string folder; std::getline(folders, folder, ':');) {
    const std::filesystem::path file = std::filesystem::path(folder) / name;
    if (!folder.empty() && IsExecutable(file)) return std::filesystem::absolute(file);
  }
  return {};
}

std::optional<Pipe> MakePipe() {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return std::nullopt;
  return Pipe{Descriptor(ends[0]), Descriptor(ends[1])};
}

std::vector<char*> Pointers(std::vector<std::string>& texts) {
  std::vector<char*> pointers;
  for (std::string& text : texts) pointers.push_back(text.data());
  pointers.push_back(nullptr);
  return pointers;
}

bool DieWith(pid_t parent, int signal) {
  ::prctl(PR_SET_PDEATHSIG, signal);
  return ::getppid() == parent;  // the parent may have died before the previous line
}

void UnblockSignals() {
  sigset_t none;
  ::sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
}

std::optional<int> WaitForEnd(pid_t child) {
  int status = 0;
  pid_t ended = -1;
  do {
    ended = ::waitpid(child, &status, 0);
  } while (ended < 0 && errno == EINTR);
  return ended < 0 ? std::nullopt : std::optional(status);
}

namespace {

constexpr std::array<int, 6> kChangedSignals = {SIGXFSZ, SIGPIPE, SIGUSR1, SIGUSR2, SIGCHLD, SIGHUP};

/// State found by PrepareProcess. Global, like signal actions and limits; written before any thread starts.
struct StartState {
  bool known = false;
  std::array<bool, kChangedSignals.size()> ignored{};  // one for each of kChangedSignals
  rlimit open_files{}, processor_time{};
};
StartState start_state;

void RememberStartState() {
  for (std::size_t i = 0; i < kChangedSignals.size(); ++i) {
    struct sigaction action {};
    start_state.ignored[i] = ::sigaction(kChangedSignals[i], nullptr, &action) == 0 && action.sa_handler == SIG_IGN;
  }
  start_state.known = ::getrlimit(RLIMIT_NOFILE, &start_state.open_files) == 0 &&
                      ::getrlimit(RLIMIT_CPU, &start_state.processor_time) == 0;
}

// Opens closed standard descriptors in the wrong direction, so that each use fails with EBADF, as glibc does for
// set-user-ID programs.
void OccupyStandardDescriptors() {
  for (const int number : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(number, F_GETFD) >= 0 || errno != EBADF) continue;
    int fd = ::open("/dev/null", number == STDIN_FILENO ? O_WRONLY : O_RDONLY);
    if (fd < 0) fd = ::open("/", O_RDONLY | O_DIRECTORY);  // no /dev
    if (fd >= 0 && fd != number) {
      ::dup2(fd, number);
      ::close(fd);
    }
  }
}

void SetSignals(ProcessKind kind) {
  ::signal(SIGXFSZ, SIG_IGN);
  ::signal(SIGCHLD, SIG_DFL);
  if (kind == ProcessKind::kJob) return;
  UnblockSignals();
  ::signal(SIGTERM, SIG_DFL);
  ::signal(SIGPIPE, SIG_IGN);
  if (kind == ProcessKind::kCommand) return;
  for (const int number : {SIGUSR1, SIGUSR2}) ::signal(number, SIG_IGN);
}

void RaiseOpenFiles() {
  rlimit limit = start_state.open_files;
  limit.rlim_cur = limit.rlim_max;
  ::setrlimit(RLIMIT_NOFILE, &limit);
}

// A hard limit of one second leaves no room.
void SeparateProcessorTimeLimits() {
  rlimit limit = start_state.processor_time;
  if (!start_state.known || limit.rlim_max == RLIM_INFINITY || limit.rlim_cur < limit.rlim_max || limit.rlim_max < 2) {
    return;
  }
  limit.rlim_cur = limit.rlim_max - 1;
  ::setrlimit(RLIMIT_CPU, &limit);
}

std::filesystem::path Existing(const std::filesystem::path& file) {
  std::error_code error;
  const std::filesystem::path found = std::filesystem::canonical(file, error);
  return !error && IsExecutable(found) ? found : std::filesystem::path();
}

}  // namespace

void PrepareProcess(ProcessKind kind) {
  OccupyStandardDescriptors();
  RememberStartState();
  SetSignals(kind);
  RaiseOpenFiles();
  SeparateProcessorTimeLimits();
  const std::size_t free = FreeDescriptors(kFewestDescriptors);
  if (free >= kFewestDescriptors) return;
  rlimit limit{};
  ::getrlimit(RLIMIT_NOFILE, &limit);
  throw std::system_error(EMFILE, std::generic_category(),
                          "only " + std::to_string(free) + " of the " + std::to_string(kFewestDescriptors) +
                              " files that this program needs can be opened; raise 'ulimit -n' (now " +
                              std::to_string(limit.rlim_cur) + ") or close inherited descriptors");
}

std::size_t FreeDescriptors(std::size_t most) {
  std::vector<Descriptor> opened;
  opened.reserve(most);
  while (opened.size() < most) {
    Descriptor next(::fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 0));
    if (!next.open()) break;
    opened.push_back(std::move(next));
  }
  return opened.size();
}

void RestoreStartState() {
  ::signal(SIGINT, SIG_DFL);
  ::signal(SIGTERM, SIG_DFL);
  if (!start_state.known) return;
  for (std::size_t i = 0; i < kChangedSignals.size(); ++i) {
    ::signal(kChangedSignals[i], start_state.ignored[i] ? SIG_IGN : SIG_DFL);
  }
  ::setrlimit(RLIMIT_NOFILE, &start_state.open_files);
  ::setrlimit(RLIMIT_CPU, &start_state.processor_time);
}

std::filesystem::path ProgramFile() {
  std::error_code error;
  if (std::filesystem::path file = std::filesystem::read_symlink("/proc/self/exe", error); !error) return file;
  const auto* started = reinterpret_cast<const char*>(::getauxval(AT_EXECFN));  // NOLINT(performance-no-int-to-ptr)
  if (started != nullptr && *started != '\0') {
    if (std::filesystem::path file = Existing(started); !file.empty()) return file;
  }
  const std::string name = program_invocation_name;
  return Existing(name.find('/') == std::string::npos ? FindProgram(name) : std::filesystem::path(name));
}

}  // namespace legopt::app

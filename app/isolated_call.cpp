#include "app/isolated_call.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <exception>
#include <new>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "app/processes.h"

namespace legopt {
namespace {

// Without /proc the size is unknown. Assumes more than any program uses, because the limit must not be below the
// current size.
rlim_t AddressSpaceBytes() {
  constexpr rlim_t kUnknown = rlim_t{4} << 30U;
  long pages = 0;  // first field of statm
  std::FILE* const statm = std::fopen("/proc/self/statm", "re");
  if (statm == nullptr) return kUnknown;
  const bool read = std::fscanf(statm, "%ld", &pages) == 1;  // reader: a whole number
  std::fclose(statm);
  return read ? static_cast<rlim_t>(pages) * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)) : kUnknown;
}

}  // namespace

void LimitMemoryGrowth(std::int64_t extra_bytes) {
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  if (extra_bytes > 0) {
    const rlim_t wanted = AddressSpaceBytes() + static_cast<rlim_t>(extra_bytes);
    limit.rlim_cur = limit.rlim_max == RLIM_INFINITY ? wanted : std::min(wanted, limit.rlim_max);
  }
  setrlimit(RLIMIT_AS, &limit);
}

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kReadBytes = 1U << 16;

// Exit codes of the process; readers do not use them.
enum ExitCode : int { kAnswered = 100, kThrew = 101, kOutOfMemory = 102, kCallerGone = 103 };

bool WriteAll(int fd, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(fd, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(count));
  }
  return true;
}

/// Disconnects from the caller: signal handlers, output, lifetime.
void BecomeIsolated(pid_t caller, const ReadLimits& limits) {
  if (!app::DieWith(caller, SIGKILL)) ::_exit(kCallerGone);
  for (const int number : {SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL, SIGXCPU, SIGALRM}) {
    ::signal(number, SIG_DFL);
  }
  // These are sent to a whole group or job; the caller reacts to them.
  for (const int number : {SIGINT, SIGHUP, SIGTERM, SIGUSR1, SIGUSR2, SIGPIPE}) ::signal(number, SIG_IGN);
  app::UnblockSignals();
  std::set_new_handler(nullptr);
  const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
  if (nowhere >= 0) {
    ::dup2(nowhere, STDOUT_FILENO);
    ::dup2(nowhere, STDERR_FILENO);
  }
  const rlimit no_core{0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
  const rlimit cpu{static_cast<rlim_t>(limits.cpu_s), static_cast<rlim_t>(limits.cpu_s) + 1};
  ::setrlimit(RLIMIT_CPU, &cpu);
  LimitMemoryGrowth(limits.memory_bytes);
}

[[noreturn]] void Answer(int fd, const std::function<std::string()>& body) {
  try {
    ::_exit(WriteAll(fd, body()) ? kAnswered : kCallerGone);
  } catch (const std::bad_alloc&) {
    ::_exit(kOutOfMemory);
  } catch (const std::exception& error) {
    WriteAll(fd, error.what());
    ::_exit(kThrew);
  } catch (...) {
    ::_exit(kThrew);
  }
}

/// Answering process, seen from its caller. The destructor kills it and waits for its end.
class Answerer {
 public:
  Answerer(pid_t pid, app::Descriptor pipe) : pid_(pid), pipe_(std::move(pipe)) {}
  Answerer(const Answerer&) = delete;
  Answerer& operator=(const Answerer&) = delete;
  ~Answerer() {
    if (pid_ > 0) {
      ::kill(pid_, SIGKILL);
      Wait();
    }
  }

  /// Reads its output until it closes the pipe; returns nothing if that is not before `deadline`.
  std::optional<std::string> Read(Clock::time_point deadline) const {
    std::string bytes;
    std::vector<char> buffer(kReadBytes);
    for (;;) {
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
      if (left <= 0) return std::nullopt;
      pollfd ready{pipe_.get(), POLLIN, 0};
      const int polled = ::poll(&ready, 1, static_cast<int>(left));
      if (polled == 0) return std::nullopt;
      if (polled < 0 && errno != EINTR) throw std::system_error(errno, std::generic_category(), "poll");
      if (polled < 0) continue;
      const ssize_t count = ::read(pipe_.get(), buffer.data(), buffer.size());
      if (count == 0) return bytes;
      if (count > 0) bytes.append(buffer.data(), static_cast<std::size_t>(count));
    }
  }

  /// Status of the process; empty if the program ignores SIGCHLD, so that the system reaps its children.
  std::optional<int> Wait() { return app::WaitForEnd(std::exchange(pid_, -1)); }

 private:
  pid_t pid_;
  app::Descriptor pipe_;
};

// Returns whether the memory of this process or its children is limited ('ulimit -v').
bool HasMemoryLimit() {
  rlimit limit{};
  return ::getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_max != RLIM_INFINITY;
}

/// Returns why a process with this status gave no answer; empty if it did. `said` is its output.
std::string Fault(int status, const std::string& said, const ReadLimits& limits) {
  const std::string too_long = "it took more than " + std::to_string(limits.cpu_s) + " s of CPU time";
  if (WIFSIGNALED(status)) {
    const int number = WTERMSIG(status);
    if (number == SIGXCPU) return too_long;
    return "it ended with signal " + std::to_string(number) + ", " + app::SignalMeaning(number);
  }
  switch (WEXITSTATUS(status)) {
    case kAnswered:
      return {};
    case kThrew:
      return said.empty() ? "it threw an exception" : said;
    case kOutOfMemory:
      return "it needed more than " + std::to_string(limits.memory_bytes >> 20) + " MiB of memory";
    default:
      return "it ended with exit code " + std::to_string(WEXITSTATUS(status));
  }
}

}  // namespace

std::string CallIsolated(const std::function<std::string()>& body, const ReadLimits& limits) {
  std::optional<app::Pipe> pipe = app::MakePipe();
  if (!pipe) throw std::system_error(errno, std::generic_category(), "no pipe to a reader of its own process");
  const pid_t caller = ::getpid();
  const pid_t child = ::fork();
  if (child == 0) {
    pipe->read.Close();
    BecomeIsolated(caller, limits);
    Answer(pipe->write.get(), body);
  }
  const int fork_error = errno;
  pipe->write.Close();
  if (child < 0) {
    pipe->read.Close();
    if (fork_error == EPERM) return body();
    throw std::system_error(fork_error, std::generic_category(), "no process for a reader could be started");
  }
  Answerer answerer(child, std::move(pipe->read));
  std::optional<std::string> answer = answerer.Read(Clock::now() + std::chrono::seconds(limits.wall_s));
  if (!answer) throw GuardedReadError("it took more than " + std::to_string(limits.wall_s) + " s");
  const std::optional<int> status = answerer.Wait();
  if (!status) throw GuardedReadError("its end was not seen, as SIGCHLD is ignored");
  const bool out_of_memory = WIFEXITED(*status) && WEXITSTATUS(*status) == kOutOfMemory;
  if (out_of_memory && HasMemoryLimit()) throw std::bad_alloc();  // caused by the machine's limit, not the reader's
  if (const std::string fault = Fault(*status, *answer, limits); !fault.empty()) throw GuardedReadError(fault);
  return std::move(*answer);
}

}  // namespace legopt

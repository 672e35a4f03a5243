#include "worker/child_process.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <optional>
#include <system_error>
#include <utility>

#include "app/processes.h"
#include "worker/outcome.h"
#include "worker/process_guards.h"

extern char** environ;

namespace legopt::worker {
namespace {

using app::Descriptor;

constexpr std::size_t kMaxReadBytes = 1U << 20;
constexpr std::int64_t kKibibyte = 1024;

[[noreturn]] void Refuse(const char* what, int error) { throw std::system_error(error, std::generic_category(), what); }

// Returns the environment of job processes. It sets one thread per job, so that timings and results do not depend on
// the machine, and omits the key file, which job processes do not need.
std::vector<std::string> ChildEnvironment() {
  std::vector<std::string> variables;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string_view text = *entry;
    if (!text.starts_with("OMP_NUM_THREADS=") && !text.starts_with("OPENBLAS_NUM_THREADS=") &&
        !text.starts_with("LEGOPT_KEY_FILE="))
      variables.emplace_back(text);
  }
  variables.emplace_back("OMP_NUM_THREADS=1");
  variables.emplace_back("OPENBLAS_NUM_THREADS=1");
  return variables;
}

struct SpawnAttributes {
  SpawnAttributes() {
    posix_spawnattr_init(&value);
    const sigset_t others = SupervisorSignals();
    sigset_t all;
    sigfillset(&all);
    posix_spawnattr_setsigmask(&value, &others);
    posix_spawnattr_setsigdefault(&value, &all);
    posix_spawnattr_setpgroup(&value, 0);
    posix_spawnattr_setflags(&value, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  }
  ~SpawnAttributes() { posix_spawnattr_destroy(&value); }
  posix_spawnattr_t value{};
};

// File actions run in order in the child. `socket` and `log` must be greater than kSocket; otherwise an earlier action
// would overwrite them.
struct SpawnFiles {
  SpawnFiles(int socket, int log) {
    posix_spawn_file_actions_init(&value);
    posix_spawn_file_actions_addopen(&value, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&value, log, STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&value, log, STDERR_FILENO);
    posix_spawn_file_actions_adddup2(&value, socket, ChildProcess::kSocket);
    posix_spawn_file_actions_addclosefrom_np(&value, ChildProcess::kSocket + 1);
  }
  ~SpawnFiles() { posix_spawn_file_actions_destroy(&value); }
  posix_spawn_file_actions_t value{};
};

int AboveSocket(int fd) {
  const int moved = fcntl(fd, F_DUPFD_CLOEXEC, ChildProcess::kSocket + 1);
  if (moved < 0) Refuse("fcntl(F_DUPFD_CLOEXEC)", errno);
  return moved;
}

}  // namespace

ChildProcess::ChildProcess(const std::vector<std::string>& command) {
  std::array<int, 2> sockets{};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, sockets.data()) != 0) Refuse("socketpair", errno);
  Descriptor ours(sockets[0]);
  const Descriptor theirs(sockets[1]);
  std::optional<app::Pipe> log = app::MakePipe();
  if (!log) Refuse("pipe2", errno);
  ours.SetNonBlocking();
  log->read.SetNonBlocking();
  const Descriptor child_socket(AboveSocket(theirs.get()));
  const Descriptor child_log(AboveSocket(log->write.get()));

  std::vector<std::string> arguments = command;
  std::vector<std::string> environment = ChildEnvironment();
  const SpawnAttributes attributes;
  const SpawnFiles files(child_socket.get(), child_log.get());
  const int error = posix_spawn(&pid_, command.front().c_str(), &files.value, &attributes.value,
                                app::Pointers(arguments).data(), app::Pointers(environment).data());
  if (error != 0) Refuse(("cannot start " + command.front()).c_str(), error);
  pidfd_ = static_cast<int>(syscall(SYS_pidfd_open, pid_, 0));
  if (pidfd_ < 0) {
    const int open_error = errno;
    Kill();
    app::WaitForEnd(pid_);
    Refuse("pidfd_open", open_error);
  }
  fcntl(pidfd_, F_SETFD, FD_CLOEXEC);
  socket_ = ours.Take();
  log_pipe_ = log->read.Take();
}

ChildProcess::~ChildProcess() {
  if (pid_ > 0) {
    Kill();
    app::WaitForEnd(pid_);
  }
  CloseDescriptors();
}

void ChildProcess::CloseDescriptors() {
  for (int* fd : {&socket_, &log_pipe_, &pidfd_}) {
    if (*fd >= 0) close(std::exchange(*fd, -1));
  }
}

bool ChildProcess::Send(const Frame& frame) {
  outgoing_ += EncodeFrame(frame);
  return Flush();
}

bool ChildProcess::Flush() {
  while (!outgoing_.empty() && socket_ >= 0) {
    const ssize_t count = send(socket_, outgoing_.data(), outgoing_.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (count > 0) {
      outgoing_.erase(0, static_cast<std::size_t>(count));
    } else if (errno == EAGAIN || errno == EWOULDBLOCK) {
      return true;
    } else if (errno != EINTR) {
      outgoing_.clear();
      return false;
    }
  }
  return socket_ >= 0;
}

bool ChildProcess::ReadSocket() {
  std::array<char, kReadBytes> buffer;  // NOLINT(cppcoreguidelines-pro-type-member-init): filled by read()
  for (std::size_t total = 0; total < kMaxReadBytes;) {
    const ssize_t count = read(socket_, buffer.data(), buffer.size());
    if (count > 0) {
      reader_.Append({buffer.data(), static_cast<std::size_t>(count)});
      total += static_cast<std::size_t>(count);
      if (static_cast<std::size_t>(count) < buffer.size()) return true;
    } else if (count < 0 && errno == EINTR) {
      continue;
    } else if (count < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) {
      return true;
    } else {
      close(std::exchange(socket_, -1));
      return false;
    }
  }
  return true;
}

std::string ChildProcess::ReadLog() {
  std::string text;
  std::array<char, kReadBytes> buffer;  // NOLINT(cppcoreguidelines-pro-type-member-init): filled by read()
  while (log_pipe_ >= 0 && text.size() < kMaxReadBytes) {
    const ssize_t count = read(log_pipe_, buffer.data(), buffer.size());
    if (count > 0) {
      text.append(buffer.data(), static_cast<std::size_t>(count));
    } else if (count < 0 && errno == EINTR) {
      continue;
    } else {
      if (count == 0) close(std::exchange(log_pipe_, -1));
      break;
    }
  }
  log_tail_ += text;
  if (log_tail_.size() > kMaxLogTailBytes) log_tail_.erase(0, log_tail_.size() - kMaxLogTailBytes);
  return text;
}

void ChildProcess::AskToStop() {
  if (pid_ > 0) kill(pid_, SIGUSR1);
}

void ChildProcess::Kill() {
  if (pid_ <= 0) return;
  kill(-pid_, SIGKILL);
  kill(pid_, SIGKILL);  // needed if it has not entered its own process group yet
}

bool ChildProcess::Reap(ChildExit* exit) {
  siginfo_t ended{};
  if (pid_ <= 0 || waitid(P_PID, static_cast<id_t>(pid_), &ended, WEXITED | WNOHANG | WNOWAIT) != 0) return false;
  if (ended.si_pid != pid_) return false;
  // Kills remaining processes of the group before its number can be reused.
  kill(-pid_, SIGKILL);
  int status = 0;
  rusage usage{};
  if (wait4(pid_, &status, 0, &usage) != pid_) return false;
  pid_ = -1;
  ReadLog();
  exit->signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  exit->exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 0;
  exit->log_tail = log_tail_;
  exit->peak_memory_bytes = static_cast<std::int64_t>(usage.ru_maxrss) * kKibibyte;
  return true;
}

}  // namespace legopt::worker

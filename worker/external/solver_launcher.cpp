#include "worker/external/solver_launcher.h"

#include <dirent.h>
#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "app/data_folder.h"
#include "app/processes.h"
#include "legopt/types/number_text.h"
#include "worker/external/line_channel.h"
#include "worker/external/solver_confinement.h"

namespace legopt::external {
namespace {

[[noreturn]] void RefuseLaunch(const char* what) { throw std::system_error(errno, std::generic_category(), what); }

[[noreturn]] void LauncherIsGone() {
  throw std::system_error(ECHILD, std::generic_category(), "the process that starts external solvers is gone");
}

/// Reply with its descriptors.
struct Answer {
  LaunchReply reply;
  SolverLauncher::Streams streams;
};

void TakeDescriptors(msghdr& message, SolverLauncher::Streams& streams) {
  const cmsghdr* header = CMSG_FIRSTHDR(&message);
  std::array<int, 4> descriptors{};
  if (header == nullptr || header->cmsg_len != CMSG_LEN(sizeof(descriptors))) return;
  std::memcpy(descriptors.data(), CMSG_DATA(header), sizeof(descriptors));
  streams.in = app::Descriptor(descriptors[0]);
  streams.out = app::Descriptor(descriptors[1]);
  streams.error = app::Descriptor(descriptors[2]);
  streams.process = app::Descriptor(descriptors[3]);
  for (const auto* stream : {&streams.in, &streams.out, &streams.error}) stream->SetNonBlocking();
}

Answer AskLauncher(int socket, const LaunchRequest& request) {
  if (::send(socket, &request, sizeof(request), MSG_NOSIGNAL) != sizeof(request)) LauncherIsGone();
  Answer answer;
  iovec part{&answer.reply, sizeof(answer.reply)};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(4 * sizeof(int))> control{};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  ssize_t size = -1;
  do {
    size = ::recvmsg(socket, &message, MSG_CMSG_CLOEXEC);
  } while (size < 0 && errno == EINTR);
  if (size != sizeof(answer.reply)) LauncherIsGone();
  TakeDescriptors(message, answer.streams);
  return answer;
}

}  // namespace

SolverLauncher::SolverLauncher(std::span<const LaunchCommand> commands, const std::filesystem::path& scratch) {
  std::array<int, 2> sockets{};
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, sockets.data()) != 0) RefuseLaunch("socketpair");
  socket_ = app::Descriptor(sockets[0]);
  const app::Descriptor theirs(sockets[1]);
  launcher_ = ::fork();
  if (launcher_ < 0) RefuseLaunch("cannot start the process that starts external solvers");
  if (launcher_ == 0) {
    const int status = ServeLaunches(theirs.get(), commands);
    std::error_code ignored;
    if (!scratch.empty()) std::filesystem::remove_all(scratch, ignored);
    ::_exit(status);
  }
}

SolverLauncher::~SolverLauncher() {
  socket_.Close();  // makes the launcher end
  app::WaitForEnd(launcher_);
}

SolverLauncher::Streams SolverLauncher::Start(std::size_t command, std::int64_t memory_bytes) {
  Answer answer = AskLauncher(socket_.get(),
                              {LaunchRequest::Kind::kStart, false, static_cast<std::uint32_t>(command), memory_bytes});
  if (answer.reply.error != 0) {
    throw SolverFault(std::string("could not be started: ") + std::strerror(answer.reply.error));
  }
  if (!answer.streams.error.open()) LauncherIsGone();
  return std::move(answer.streams);
}

void SolverLauncher::CountFromNow() { AskLauncher(socket_.get(), {LaunchRequest::Kind::kCount, false, 0, 0}); }

ProcessEnd SolverLauncher::End(bool leaving) {
  const ProcessEnd end = AskLauncher(socket_.get(), {LaunchRequest::Kind::kEnd, leaving, 0, 0}).reply.end;
  usage_.cpu_us += end.usage.cpu_us;
  usage_.peak_memory_bytes = std::max(usage_.peak_memory_bytes, end.usage.peak_memory_bytes);
  return end;
}

namespace {

using app::Descriptor;

constexpr int kLaunchSocket = 3;  // descriptor of the socket in the launcher
constexpr int kExecFailed = 127;
constexpr int kLeavingRounds = 200, kRoundMicroseconds = 5'000;  // a second in total

/// The running solver.
struct Running {
  pid_t pid = -1;
  std::int64_t cpu_before_us = 0;  ///< CPU time used before counting started
};

/// Pipes for the three standard streams of a solver.
struct StreamPipes {
  std::optional<app::Pipe> in = app::MakePipe(), out = app::MakePipe(), error = app::MakePipe();

  bool complete() const { return in && out && error; }
};

void LimitSolver(std::int64_t memory_bytes) {
  const rlimit no_core{0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
  const rlimit file{static_cast<rlim_t>(SolverLauncher::kMaxFileBytes),
                    static_cast<rlim_t>(SolverLauncher::kMaxFileBytes)};
  ::setrlimit(RLIMIT_FSIZE, &file);
  if (memory_bytes <= 0) return;
  const rlimit memory{static_cast<rlim_t>(memory_bytes), static_cast<rlim_t>(memory_bytes)};
  ::setrlimit(RLIMIT_AS, &memory);
}

// Turns the new process into the solver. Returns only on failure, with errno set.
void BecomeSolver(pid_t launcher, const StreamPipes& streams, const LaunchCommand& command, char** arguments,
                  char** environment, std::int64_t memory_bytes) {
  ::setpgid(0, 0);
  ConfineSolver(command.needs_network);  // entering a user namespace may clear the signal set in the next line
  if (!app::DieWith(launcher, SIGKILL)) return;
  ::dup2(streams.in->read.get(), STDIN_FILENO);
  ::dup2(streams.out->write.get(), STDOUT_FILENO);
  ::dup2(streams.error->write.get(), STDERR_FILENO);
  if (::chdir(command.folder.c_str()) != 0) return;
  app::RestoreStartState();
  LimitSolver(memory_bytes);
  app::UnblockSignals();
  ::execve(command.executable.c_str(), arguments, environment);
}

/// Returns 0, or the errno with which the start failed.
int StartSolver(const LaunchCommand& command, const StreamPipes& streams, std::int64_t memory_bytes, Running& running) {
  std::optional<app::Pipe> failure = app::MakePipe();
  if (!failure) return errno;
  std::vector<std::string> texts = command.arguments;
  const std::vector<char*> arguments = app::Pointers(texts);
  std::vector<std::string> variables = SolverEnvironment(command.variables);
  const std::vector<char*> environment = app::Pointers(variables);
  const pid_t launcher = ::getpid();
  const pid_t pid = ::fork();
  if (pid < 0) return errno;
  if (pid == 0) {
    BecomeSolver(launcher, streams, command, const_cast<char**>(arguments.data()),
                 const_cast<char**>(environment.data()), memory_bytes);
    const int error = errno;
    [[maybe_unused]] const ssize_t written = ::write(failure->write.get(), &error, sizeof(error));
    ::_exit(kExecFailed);
  }
  ::setpgid(pid, pid);  // also done in the child; one of both comes first
  running.pid = pid;
  failure->write.Close();
  int error = 0;
  return ::read(failure->read.get(), &error, sizeof(error)) == sizeof(error) ? error : 0;
}

// Reads field 4 of /proc/PID/stat, after the name, which may contain any characters.
pid_t ParentOf(const char* pid) {
  std::array<char, 512> text{};
  std::FILE* stat = std::fopen(("/proc/" + std::string(pid) + "/stat").c_str(), "re");
  if (stat == nullptr) return -1;
  const std::size_t size = std::fread(text.data(), 1, text.size() - 1, stat);
  std::fclose(stat);
  text[size] = '\0';
  const char* behind_name = std::strrchr(text.data(), ')');
  int parent = -1;
  char state = 0;
  if (behind_name == nullptr) return -1;
  if (std::sscanf(behind_name + 1, " %c %d", &state, &parent) != 2) return -1;  // reader: whole numbers
  return parent;
}

std::int64_t CpuTimeOf(pid_t pid) {
  clockid_t clock{};
  timespec time{};
  if (::clock_getcpuclockid(pid, &clock) != 0 || ::clock_gettime(clock, &time) != 0) return 0;
  return std::int64_t{time.tv_sec} * 1'000'000 + time.tv_nsec / 1'000;
}

// Waits for one child, or for any (-1), and adds the resources used by it and by the children for which it has waited.
// With WNOHANG, returns 0 if none has ended.
pid_t WaitAndCount(pid_t pid, int* status, ProcessUsage& usage, int options = 0) {
  rusage used{};
  pid_t ended = -1;
  do {
    ended = ::wait4(pid, status, options, &used);
  } while (ended < 0 && errno == EINTR);
  if (ended <= 0) return ended;
  for (const timeval& time : {used.ru_utime, used.ru_stime}) {
    usage.cpu_us += std::int64_t{time.tv_sec} * 1'000'000 + time.tv_usec;
  }
  usage.peak_memory_bytes = std::max(usage.peak_memory_bytes, std::int64_t{used.ru_maxrss} * 1024);
  return ended;
}

// Kills all children. Returns false if they are unknown because /proc is not mounted.
bool KillChildren() {
  DIR* processes = ::opendir("/proc");
  if (processes == nullptr) return false;
  bool any = false;
  while (const dirent* entry = ::readdir(processes)) {
    const auto process = ParseInteger<pid_t>(entry->d_name);
    if (!process || *process < 1) continue;
    any = true;
    if (ParentOf(entry->d_name) == ::getpid()) ::kill(*process, SIGKILL);
  }
  ::closedir(processes);
  return any;
}

// Kills all descendants. Orphans of ended processes become children of this process, so it repeats until none is left.
void EndDescendants(ProcessUsage& usage) {
  pid_t ended = 0;
  do {
    // Without /proc children cannot be killed, so do not wait for running ones.
    const int options = KillChildren() ? 0 : WNOHANG;
    ended = WaitAndCount(-1, nullptr, usage, options);
  } while (ended > 0);
}

bool HasEnded(pid_t pid) {
  siginfo_t info{};
  return ::waitid(P_PID, static_cast<id_t>(pid), &info, WEXITED | WNOHANG | WNOWAIT) != 0 || info.si_pid == pid;
}

ProcessEnd EndSolver(Running& running, bool leaving) {
  ProcessEnd end;
  if (running.pid <= 0) return end;
  for (int round = 0; leaving && round < kLeavingRounds && !HasEnded(running.pid); ++round) {
    ::usleep(kRoundMicroseconds);
  }
  end.killed = !HasEnded(running.pid);
  ::kill(-running.pid, SIGKILL);  // before the number of its group can be reused
  WaitAndCount(running.pid, &end.status, end.usage);
  EndDescendants(end.usage);
  end.usage.cpu_us = std::max<std::int64_t>(0, end.usage.cpu_us - running.cpu_before_us);
  running = {};
  return end;
}

void Reply(const LaunchReply& reply, const StreamPipes* streams, int process = -1) {
  iovec part{const_cast<LaunchReply*>(&reply), sizeof(reply)};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  std::array<int, 4> descriptors{};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(descriptors))> control{};
  if (streams != nullptr) {
    descriptors = {streams->in->write.get(), streams->out->read.get(), streams->error->read.get(), process};
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    cmsghdr* header = CMSG_FIRSTHDR(&message);
    header->cmsg_level = SOL_SOCKET;
    header->cmsg_type = SCM_RIGHTS;
    header->cmsg_len = CMSG_LEN(sizeof(descriptors));
    std::memcpy(CMSG_DATA(header), descriptors.data(), sizeof(descriptors));
  }
  ::sendmsg(kLaunchSocket, &message, MSG_NOSIGNAL);
}

void AnswerStart(const LaunchRequest& request, std::span<const LaunchCommand> commands, Running& running) {
  EndSolver(running, false);
  const StreamPipes streams;
  LaunchReply reply;
  reply.error = streams.complete() && request.command < commands.size()
                    ? StartSolver(commands[request.command], streams, request.memory_bytes, running)
                    : EMFILE;
  const Descriptor process(reply.error == 0 ? static_cast<int>(::syscall(SYS_pidfd_open, running.pid, 0)) : -1);
  if (reply.error == 0 && !process.open()) reply.error = errno;
  Reply(reply, reply.error == 0 ? &streams : nullptr, process.get());
}

// Lets solvers in Python import legopt.solver. The user's own path comes first.
void OfferPythonPackage() {
  const std::string folder = app::PythonFolder().string();
  if (folder.empty()) return;
  const char* path = std::getenv("PYTHONPATH");
  const std::string before = path == nullptr || *path == '\0' ? std::string() : std::string(path) + ":";
  ::setenv("PYTHONPATH", (before + folder).c_str(), 1);
}

// Gives up everything inherited from the owner: handlers, descriptors except standard error, process group.
void BecomeLauncher(int socket) {
  ::setpgid(0, 0);
  ::prctl(PR_SET_CHILD_SUBREAPER, 1);
  for (int number = 1; number < NSIG; ++number) ::signal(number, SIG_DFL);
  const int nowhere = ::open("/dev/null", O_RDWR);
  ::dup2(nowhere, STDIN_FILENO);
  ::dup2(nowhere, STDOUT_FILENO);
  if (socket != kLaunchSocket) ::dup3(socket, kLaunchSocket, O_CLOEXEC);
  ::close_range(kLaunchSocket + 1, ~0U, 0);
  OfferPythonPackage();
  ::setenv("OMP_NUM_THREADS", "1", 1);
  ::setenv("OPENBLAS_NUM_THREADS", "1", 1);
  HideFromOtherProcesses();
}

}  // namespace

int ServeLaunches(int socket, std::span<const LaunchCommand> commands) {
  BecomeLauncher(socket);
  Running running;
  for (;;) {
    LaunchRequest request;
    const ssize_t size = ::recv(kLaunchSocket, &request, sizeof(request), 0);
    if (size < 0 && errno == EINTR) continue;
    if (size != sizeof(request)) break;  // the owner has ended
    if (request.kind == LaunchRequest::Kind::kStart) {
      AnswerStart(request, commands, running);
    } else if (request.kind == LaunchRequest::Kind::kCount) {
      running.cpu_before_us = CpuTimeOf(running.pid);
      Reply({}, nullptr);
    } else {
      Reply({0, EndSolver(running, request.leaving)}, nullptr);
    }
  }
  EndSolver(running, false);
  return 0;
}

}  // namespace legopt::external

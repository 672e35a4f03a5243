#include "worker/job_process.h"

#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <new>
#include <optional>
#include <string>

#include "app/isolated_call.h"
#include "app/processes.h"
#include "bus/codec.h"
#include "worker/child_process.h"
#include "worker/external/solver_confinement.h"
#include "worker/job_executor.h"
#include "worker/job_slot.h"

namespace legopt::worker {
namespace {

constexpr rlim_t kMaxDescriptors = 256;
constexpr std::size_t kSignalStackBytes = 1U << 16;
// A crash at an address below this is treated as dereferencing a null pointer (plus a member or small index).
constexpr std::uintptr_t kNullPageBytes = 1U << 20;
// If a block of this size cannot be mapped, memory was exhausted.
constexpr std::size_t kProbeBytes = std::size_t{1} << 22;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;  // sanitizers have their own crash reports
#else
constexpr bool kSanitized = false;
#endif

void Say(const char* text) {
  // Nothing can be done about a failure here.
  [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, text, std::strlen(text));
}

[[noreturn]] void ExitOutOfMemory() {
  Say("out of memory: the job's memory limit is reached\n");
  _exit(kChildOutOfMemory);
}

bool MemoryExhausted() {
  void* probe = mmap(nullptr, kProbeBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (probe == MAP_FAILED) return true;
  munmap(probe, kProbeBytes);
  return false;
}

// C libraries often do not check malloc. A failed allocation then causes a null dereference or an abort while errno is
// still set. Async-signal-safe.
void OnCrash(int signal, siginfo_t* info, void* /*context*/) {
  const bool allocation_failed = errno == ENOMEM;
  const bool at_null = signal == SIGABRT || reinterpret_cast<std::uintptr_t>(info->si_addr) < kNullPageBytes;
  if ((allocation_failed && at_null) || MemoryExhausted()) ExitOutOfMemory();
  // SA_RESETHAND has restored the default action, so the process dies of the signal itself and the supervisor sees it.
  raise(signal);
}

}  // namespace

sigset_t SupervisorSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGTERM, SIGINT, SIGHUP, SIGUSR1, SIGUSR2}) sigaddset(&signals, signal);
  return signals;
}

void DieWithSupervisor(int supervisor_pid) {
  if (!app::DieWith(supervisor_pid, SIGKILL)) _exit(kChildOrphaned);
}

void LimitResources() {
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  rlimit files{};
  if (getrlimit(RLIMIT_NOFILE, &files) == 0 && (files.rlim_cur == RLIM_INFINITY || files.rlim_cur > kMaxDescriptors)) {
    files.rlim_cur = kMaxDescriptors;
    files.rlim_max = kMaxDescriptors;
    setrlimit(RLIMIT_NOFILE, &files);
  }
}

void ReportMemoryExhaustion() {
  std::set_new_handler(ExitOutOfMemory);
  if (kSanitized) return;
  static std::array<std::byte, kSignalStackBytes> signal_stack;
  stack_t stack{};
  stack.ss_sp = signal_stack.data();
  stack.ss_size = signal_stack.size();
  sigaltstack(&stack, nullptr);
  struct sigaction action {};
  action.sa_sigaction = OnCrash;
  action.sa_flags = SA_SIGINFO | SA_ONSTACK | SA_RESETHAND | SA_NODEFER;
  for (const int signal : {SIGSEGV, SIGBUS, SIGABRT}) sigaction(signal, &action, nullptr);
}

void ResetPeakMemory() {
  // Opened once, because a process that hides from others may not open it later.
  static const int fd = open("/proc/self/clear_refs", O_WRONLY | O_CLOEXEC);
  if (fd < 0) return;
  // "5" resets the maximum resident size. If that is refused, the peak is that of the whole process.
  [[maybe_unused]] const ssize_t written = write(fd, "5", 1);
}

#if defined(__x86_64__)

bool ForbidNewProcesses() {
  constexpr std::uint32_t kDeny = SECCOMP_RET_ERRNO | EPERM;
  // clone3 has its flags behind a pointer, which a filter cannot check; if it is missing, libc falls back to clone.
  constexpr std::uint32_t kAbsent = SECCOMP_RET_ERRNO | ENOSYS;
  constexpr std::uint32_t kX32Bit = 0x40000000;
  const auto load = [](std::size_t offset) -> sock_filter {
    return BPF_STMT(BPF_LD | BPF_W | BPF_ABS, static_cast<std::uint32_t>(offset));
  };
  const auto returns = [](std::uint32_t value) -> sock_filter { return BPF_STMT(BPF_RET | BPF_K, value); };
  // Skips `skip` instructions unless equal.
  const auto if_equal = [](std::uint32_t value, std::uint8_t otherwise) -> sock_filter {
    return BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, value, 0, otherwise);
  };
  std::array<sock_filter, 22> program = {
      load(offsetof(seccomp_data, arch)),
      if_equal(AUDIT_ARCH_X86_64, 1),
      BPF_JUMP(BPF_JMP | BPF_JA, 1, 0, 0),
      returns(kDeny),
      load(offsetof(seccomp_data, nr)),
      BPF_JUMP(BPF_JMP | BPF_JGE | BPF_K, kX32Bit, 0, 1),
      returns(kDeny),
      if_equal(SYS_clone3, 1),
      returns(kAbsent),
      if_equal(SYS_fork, 1),
      returns(kDeny),
      if_equal(SYS_vfork, 1),
      returns(kDeny),
      if_equal(SYS_execve, 1),
      returns(kDeny),
      if_equal(SYS_execveat, 1),
      returns(kDeny),
      if_equal(SYS_clone, 3),
      load(offsetof(seccomp_data, args)),  // low half of the flags, little endian
      BPF_JUMP(BPF_JMP | BPF_JSET | BPF_K, CLONE_THREAD, 1, 0),
      returns(kDeny),
      returns(SECCOMP_RET_ALLOW),
  };
  sock_fprog filter{};
  filter.len = static_cast<unsigned short>(program.size());
  filter.filter = program.data();
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return false;
  return prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter) == 0;
}

#else

bool ForbidNewProcesses() { return false; }

#endif

namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kProgressInterval = std::chrono::milliseconds(100);
constexpr int kStartFailed = 1;

// Written only by the signal handler; cleared at the start of a job. The supervisor does not send the signal after it
// has received the job's result, so no request reaches the wrong job.
volatile std::sig_atomic_t stop_requested = 0;
volatile std::sig_atomic_t stop_requester = 0;  // process id of the supervisor

// Batch systems also send this signal, to every process of a job, as a warning that its time is nearly over.
void OnStopRequest(int /*signal*/, siginfo_t* info, void* /*context*/) {
  if (info->si_code == SI_USER && info->si_pid == stop_requester) stop_requested = 1;
}

void ListenToStopRequests(int supervisor_pid) {
  stop_requester = supervisor_pid;
  struct sigaction action {};
  action.sa_sigaction = OnStopRequest;
  action.sa_flags = SA_SIGINFO | SA_RESTART;
  sigaction(SIGUSR1, &action, nullptr);
  sigset_t requests;
  sigemptyset(&requests);
  sigaddset(&requests, SIGUSR1);
  sigprocmask(SIG_UNBLOCK, &requests, nullptr);
}

// Child's end of the socket pair. Exits the process if the supervisor is gone.
class Channel {
 public:
  explicit Channel(int fd) : fd_(fd) {}

  // Waits for the next frame; returns nothing if the supervisor has closed the socket.
  std::optional<Frame> Read() {
    Frame frame;
    std::string why;
    for (;;) {
      const FrameReader::Status status = reader_.Next(&frame, &why);
      if (status == FrameReader::Status::kFrame) return frame;
      if (status == FrameReader::Status::kGarbage) {
        std::fprintf(stderr, "supervisor sent garbage: %s\n", why.c_str());
        return std::nullopt;
      }
      const ssize_t count = read(fd_, buffer_.data(), buffer_.size());
      if (count == 0 || (count < 0 && errno != EINTR)) return std::nullopt;
      if (count > 0) reader_.Append({buffer_.data(), static_cast<std::size_t>(count)});
    }
  }

  void Write(FrameType type, std::uint64_t sequence, std::string body) {
    const std::string bytes = EncodeFrame({type, sequence, std::move(body)});
    std::string_view rest = bytes;
    while (!rest.empty()) {
      const ssize_t count = send(fd_, rest.data(), rest.size(), MSG_NOSIGNAL);
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) _exit(kChildOrphaned);
      rest.remove_prefix(static_cast<std::size_t>(count));
    }
  }

 private:
  int fd_;
  FrameReader reader_;
  std::array<char, kReadBytes> buffer_{};
};

legopt_msg::result_request Execute(JobExecutor& executor, Channel& channel, const Frame& frame,
                                   const legopt_msg::lease& lease, const std::string& options_json) {
  Clock::time_point last_progress = Clock::now();
  JobExecutor::Hooks hooks;
  hooks.cancelled = [] { return stop_requested != 0; };
  hooks.progress = [&](int done, int total) {
    const Clock::time_point now = Clock::now();
    if (now - last_progress < kProgressInterval) return;
    last_progress = now;
    channel.Write(FrameType::kProgress, frame.sequence, EncodeProgress(done, total));
  };
  hooks.judging = [&] { channel.Write(FrameType::kJudging, frame.sequence, {}); };
  try {
    return executor.Execute(lease, options_json, hooks);
  } catch (const std::bad_alloc&) {
    // The state of the job's objects is unknown, so the process exits and is started again.
    std::fprintf(stderr, "out of memory: an allocation failed\n");
    _exit(kChildOutOfMemory);
  } catch (const JobRefused& refusal) {
    return ResultWithoutSolution(ReportedOutcome::kRefused, refusal.what());
  } catch (const std::exception& error) {
    return ResultWithoutSolution(ReportedOutcome::kError, error.what());
  }
}

std::string EncodeResult(const legopt_msg::lease& lease, legopt_msg::result_request result) {
  result.worker_id = 1;  // replaced by the supervisor
  result.job_id = lease.job_id;
  result.attempt = lease.attempt;
  result.token = lease.token;
  try {
    std::string body = bus::Encode(result);
    if (body.size() <= kMaxFrameBytes) return body;
    result = ResultWithoutSolution(ReportedOutcome::kError, "the result is too large to be sent");
  } catch (const bus::BusError& error) {
    result = ResultWithoutSolution(ReportedOutcome::kError, error.what());
  }
  return EncodeResult(lease, std::move(result));
}

int ServeJobs(Channel& channel, JobExecutor& executor) {
  while (const std::optional<Frame> frame = channel.Read()) {
    legopt_msg::lease lease;
    std::string options_json;
    if (frame->type != FrameType::kJob || !DecodeJob(frame->body, &lease, &options_json)) {
      std::fprintf(stderr, "the supervisor sent an invalid job\n");
      return kChildOrphaned;
    }
    stop_requested = 0;
    ResetPeakMemory();
    LimitMemoryGrowth(lease.memory_limit_bytes);
    const legopt_msg::result_request result = Execute(executor, channel, *frame, lease, options_json);
    LimitMemoryGrowth(0);
    channel.Write(FrameType::kResult, frame->sequence, EncodeResult(lease, result));
  }
  return 0;
}

}  // namespace

int RunJobProcess(int fd, int supervisor_pid, JobExecutor& executor) {
  DieWithSupervisor(supervisor_pid);
  LimitResources();
  ReportMemoryExhaustion();
  ListenToStopRequests(supervisor_pid);

  Channel channel(fd);
  std::vector<Capability> loaded;
  try {
    loaded = executor.Load();
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "out of memory while the datasets were loaded\n");
    return kChildOutOfMemory;
  } catch (const std::exception& error) {
    channel.Write(FrameType::kStartFailed, 0, PrintableText(error.what(), kMaxMessageBytes));
    return kStartFailed;
  }
  ResetPeakMemory();
  external::HideFromOtherProcesses();
  if (!ForbidNewProcesses()) std::fprintf(stderr, "warning: this system cannot keep jobs from starting processes\n");
  channel.Write(FrameType::kReady, 0, EncodeCapabilities(loaded));
  return ServeJobs(channel, executor);
}

}  // namespace legopt::worker

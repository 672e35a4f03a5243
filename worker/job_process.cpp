#include "worker/job_process.h"

#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <exception>
#include <new>
#include <optional>
#include <string>

#include "app/process_limits.h"
#include "bus/codec.h"
#include "worker/child_protocol.h"
#include "worker/external/solver_confinement.h"
#include "worker/job_slot.h"
#include "worker/outcome.h"
#include "worker/process_guards.h"

namespace legopt::worker {
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

// A job process for the supervision tests, and a supervisor that a test can kill.
//
// misbehaving_process SUPERVISOR_PID ok|input_error|crash|garbage   job process; the word selects its start
// misbehaving_process supervise                                     supervisor with one endless job; prints the pid
//                                                                   of its process

#include <spdlog/sinks/null_sink.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "app/isolated_call.h"
#include "legopt/types/input_error.h"
#include "tests/worker/fake_server.h"
#include "tests/worker/misbehaviour.h"
#include "worker/child_process.h"
#include "worker/job_executor.h"
#include "worker/job_process.h"
#include "worker/supervisor.h"

namespace legopt::worker {
namespace {

// Keeps the optimizer from removing the faulty code.
volatile std::size_t sink = 0;

[[noreturn]] void LoopForEver() {
  for (;;) sink = sink + 1;
}

void WriteToSupervisor(const std::string& bytes) {
  if (write(ChildProcess::kSocket, bytes.data(), bytes.size()) < 0) std::abort();
}

void AllocateByNew() {
  std::vector<char*> blocks;
  for (;;) {
    constexpr std::size_t kBlock = std::size_t{8} << 20;
    blocks.push_back(new char[kBlock]);
    std::memset(blocks.back(), 1, kBlock);
    sink = sink + static_cast<std::size_t>(blocks.back()[0]);
  }
}

void AllocateByMalloc() {
  for (;;) {
    constexpr std::size_t kBlock = std::size_t{8} << 20;
    auto* block = static_cast<volatile char*>(std::malloc(kBlock));
    for (std::size_t i = 0; i < kBlock; i += 4096) block[i] = 1;
  }
}

int CountForks() {
  int started = 0;
  for (int i = 0; i < 100; ++i) {
    const pid_t pid = fork();
    if (pid == 0) LoopForEver();
    if (pid > 0) ++started;
  }
  return started;
}

bool ThreadWorks() {
  bool ran = false;
  std::thread([&ran] { ran = true; }).join();
  return ran;
}

class MisbehavingExecutor final : public JobExecutor {
 public:
  explicit MisbehavingExecutor(std::string start) : start_(std::move(start)) {}

  std::vector<Capability> Load() override {
    if (start_ == "input_error") throw InputError({"robot.urdf", "link", "elbow", "no such link", "check the name"});
    if (start_ == "garbage") WriteToSupervisor("hello world, this is no frame at all, is it?");
    if (start_ == "crash") {
      std::fprintf(stderr, "about to crash at start\n");
      std::abort();
    }
    return {{"garage", HexHash('d')}};
  }

  legopt_msg::result_request Execute(const legopt_msg::lease& job, std::string_view /*options_json*/,
                                     const Hooks& hooks) override {
    legopt_msg::result_request result = ResultWithoutSolution(ReportedOutcome::kFinished, "");
    switch (static_cast<Misbehaviour>(job.problem_id)) {
      case Misbehaviour::kNone:
        break;
      case Misbehaviour::kSegfault:
        *reinterpret_cast<volatile int*>(std::uintptr_t{0x7fff00000000}) = 1;
        break;
      case Misbehaviour::kAbort:
        std::fprintf(stderr, "first line\nlast line before the end\n");
        std::abort();
      case Misbehaviour::kLoop:
        LoopForEver();
      case Misbehaviour::kAllocateByNew:
        AllocateByNew();
        break;
      case Misbehaviour::kAllocateByMalloc:
        AllocateByMalloc();
        break;
      case Misbehaviour::kHugeVector:
        sink = std::vector<double>(std::size_t{1} << 40).size();
        break;
      case Misbehaviour::kGarbage:
        WriteToSupervisor(std::string(100'000, 'x'));
        LoopForEver();
      case Misbehaviour::kForgedFrame:
        WriteToSupervisor(EncodeFrame({FrameType::kJob, 1, "do this"}));
        LoopForEver();
      case Misbehaviour::kLyingResult:
        WriteToSupervisor(EncodeFrame({FrameType::kResult, 12345, "not a result either"}));
        LoopForEver();
      case Misbehaviour::kSilentExit:
        std::_Exit(0);
      case Misbehaviour::kCloseChannel:
        close(ChildProcess::kSocket);
        LoopForEver();
      case Misbehaviour::kUntilCancelled:
        while (!hooks.cancelled()) sink = sink + 1;
        break;
      case Misbehaviour::kForkBomb:
        result.iterations = CountForks();
        break;
      case Misbehaviour::kIsolatedCall:
        result.message = CallIsolated([] { return std::string("answered"); }, {});
        break;
      case Misbehaviour::kExec:
        result.iterations = execl("/bin/true", "true", static_cast<char*>(nullptr)) == -1 ? 1 : 0;
        break;
      case Misbehaviour::kThread:
        result.iterations = ThreadWorks() ? 1 : 0;
        break;
      case Misbehaviour::kThrow:
        throw std::runtime_error("no such problem");
      case Misbehaviour::kChatter:
        for (int i = 0; i < 100'000; ++i) std::fprintf(stderr, "line %d of much too much\n", i);
        std::abort();
    }
    return result;
  }

 private:
  std::string start_;
};

int Supervise(const char* program) {
  FakeServer server;
  server.Queue(Misbehaviour::kLoop, std::chrono::hours(1));
  SupervisorOptions options;
  options.pool = TestPoolOptions(1);
  options.child_command = {program, std::to_string(getpid()), "ok"};
  spdlog::logger logger("test", std::make_shared<spdlog::sinks::null_sink_st>());
  Supervisor supervisor(server, options, logger);
  // Called from within Run: the process is solving.
  server.on_wait = [&] {
    if (supervisor.pool().num_running() == 0) return;
    std::printf("%d\n", supervisor.child_pid(0));
    std::fflush(stdout);
    server.on_wait = nullptr;
  };
  return StatusOf(supervisor.Run());
}

}  // namespace
}  // namespace legopt::worker

int main(int argc, char** argv) {
  if (argc == 2 && std::string(argv[1]) == "supervise") return legopt::worker::Supervise("/proc/self/exe");
  if (argc != 3) return 2;
  legopt::worker::MisbehavingExecutor executor(argv[2]);
  return legopt::worker::RunJobProcess(legopt::worker::ChildProcess::kSocket, std::atoi(argv[1]), executor);
}

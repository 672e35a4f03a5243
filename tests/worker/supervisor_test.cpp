// A real supervisor and real job processes that misbehave, with a simulated server. Each misbehaviour costs one
// attempt of one job, with evidence, and nothing else.

#include "worker/supervisor.h"

#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdio>
#include <sstream>

#include "app/exit_codes.h"
#include "tests/folders.h"
#include "tests/worker/fake_server.h"

namespace legopt::worker {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif

std::string MisbehavingProcess() { return BuildFolder() + "/tests/misbehaving_process"; }

class SupervisorTest : public testing::Test {
 protected:
  // Works until all queued jobs have a result or the worker gives up; returns its exit status.
  ExitCode Run(int slots = 1, const std::string& start = "ok") {
    SupervisorOptions options;
    options.pool = TestPoolOptions(slots);
    options.child_command = {MisbehavingProcess(), std::to_string(getpid()), start};
    spdlog::logger logger("test", std::make_shared<spdlog::sinks::ostream_sink_st>(log_));
    return Supervisor(server_, options, logger).Run();
  }

  // Runs one misbehaving job between two good ones, which must not be affected.
  legopt_msg::result_request RunOne(Misbehaviour what, microseconds wall_limit = seconds(60)) {
    const std::int64_t before = server_.Queue(Misbehaviour::kNone);
    const std::int64_t job = server_.Queue(what, wall_limit);
    const std::int64_t after = server_.Queue(Misbehaviour::kNone);
    EXPECT_EQ(Run(), ExitCode::kOk) << log_.str();
    EXPECT_EQ(server_.results[before].outcome, Code(ReportedOutcome::kFinished));
    EXPECT_EQ(server_.results[after].outcome, Code(ReportedOutcome::kFinished)) << server_.results[after].message;
    return server_.results[job];
  }

  static int Code(ReportedOutcome outcome) { return static_cast<int>(outcome); }

  FakeServer server_;
  std::ostringstream log_;
};

TEST_F(SupervisorTest, RunsJobsOnAllSlots) {
  for (int i = 0; i < 200; ++i) server_.Queue(Misbehaviour::kNone);
  EXPECT_EQ(Run(3), ExitCode::kOk) << log_.str();
  EXPECT_EQ(server_.results.size(), 200U);
  for (const auto& [id, result] : server_.results) {
    EXPECT_EQ(result.outcome, Code(ReportedOutcome::kFinished));
    EXPECT_EQ(result.token, server_.leases[id].token);
  }
}

TEST_F(SupervisorTest, SegmentationFault) {
  const auto result = RunOne(Misbehaviour::kSegfault);
  EXPECT_EQ(result.outcome, Code(ReportedOutcome::kCrashed));
  if (!kSanitized) {
    EXPECT_EQ(result.exit_signal, SIGSEGV);
  }
}

TEST_F(SupervisorTest, AbortWithItsLastWords) {
  const auto result = RunOne(Misbehaviour::kAbort);
  EXPECT_EQ(result.outcome, Code(ReportedOutcome::kCrashed));
  EXPECT_EQ(result.exit_signal, SIGABRT);
  EXPECT_NE(result.log_tail.find("last line before the end"), std::string::npos);
}

TEST_F(SupervisorTest, EndlessLoopIsKilledAtItsLimit) {
  const auto result = RunOne(Misbehaviour::kLoop, milliseconds(100));
  EXPECT_EQ(result.outcome, Code(ReportedOutcome::kTimeLimit));
  EXPECT_EQ(result.exit_signal, SIGKILL);
  EXPECT_NE(result.message.find("0.1 s"), std::string::npos) << result.message;
}

TEST_F(SupervisorTest, AllocationWithoutEndIsAMemoryLimit) {
  if (kSanitized) GTEST_SKIP() << "sanitizers answer failed allocations themselves";
  EXPECT_EQ(RunOne(Misbehaviour::kAllocateByNew).outcome, Code(ReportedOutcome::kMemoryLimit));
}

TEST_F(SupervisorTest, UncheckedMallocIsAMemoryLimitToo) {
  if (kSanitized) GTEST_SKIP() << "sanitizers answer failed allocations themselves";
  EXPECT_EQ(RunOne(Misbehaviour::kAllocateByMalloc).outcome, Code(ReportedOutcome::kMemoryLimit));
}

TEST_F(SupervisorTest, OneImpossibleAllocationIsAMemoryLimit) {
  if (kSanitized) GTEST_SKIP() << "sanitizers answer failed allocations themselves";
  EXPECT_EQ(RunOne(Misbehaviour::kHugeVector).outcome, Code(ReportedOutcome::kMemoryLimit));
}

TEST_F(SupervisorTest, GarbageOnTheChannel) {
  const auto result = RunOne(Misbehaviour::kGarbage);
  EXPECT_EQ(result.outcome, Code(ReportedOutcome::kCrashed));
  EXPECT_NE(result.message.find("protocol"), std::string::npos) << result.message;
}

TEST_F(SupervisorTest, AFrameThatIsNotForTheSupervisor) {
  EXPECT_EQ(RunOne(Misbehaviour::kForgedFrame).outcome, Code(ReportedOutcome::kCrashed));
}

TEST_F(SupervisorTest, AResultThatIsNone) {
  EXPECT_EQ(RunOne(Misbehaviour::kLyingResult).outcome, Code(ReportedOutcome::kCrashed));
}

TEST_F(SupervisorTest, SilentExit) {
  const auto result = RunOne(Misbehaviour::kSilentExit);
  EXPECT_EQ(result.outcome, Code(ReportedOutcome::kCrashed));
  EXPECT_EQ(result.exit_signal, 0);
}

TEST_F(SupervisorTest, AClosedChannelDoesNotHoldTheSlot) {
  EXPECT_EQ(RunOne(Misbehaviour::kCloseChannel).outcome, Code(ReportedOutcome::kCrashed));
}

TEST_F(SupervisorTest, AForkBombStartsNothing) {
  const auto result = RunOne(Misbehaviour::kForkBomb);
  EXPECT_EQ(result.outcome, Code(ReportedOutcome::kFinished));
  EXPECT_EQ(result.iterations, 0) << "processes started";
}

TEST_F(SupervisorTest, WhatShouldBeIsolatedRunsInTheJob) {
  const auto result = RunOne(Misbehaviour::kIsolatedCall);
  EXPECT_EQ(result.outcome, Code(ReportedOutcome::kFinished));
  EXPECT_EQ(result.message, "answered");
}

TEST_F(SupervisorTest, AJobCannotBecomeAnotherProgram) { EXPECT_EQ(RunOne(Misbehaviour::kExec).iterations, 1); }

TEST_F(SupervisorTest, AJobMayUseThreads) { EXPECT_EQ(RunOne(Misbehaviour::kThread).iterations, 1); }

TEST_F(SupervisorTest, AnExceptionIsAnErrorWithItsText) {
  const auto result = RunOne(Misbehaviour::kThrow);
  EXPECT_EQ(result.outcome, Code(ReportedOutcome::kError));
  EXPECT_EQ(result.message, "no such problem");
}

TEST_F(SupervisorTest, MuchLogIsCutToItsTail) {
  const auto result = RunOne(Misbehaviour::kChatter);
  EXPECT_EQ(result.outcome, Code(ReportedOutcome::kCrashed));
  EXPECT_LE(result.log_tail.size(), kMaxLogTailBytes);
  EXPECT_NE(result.log_tail.find("line 99999 of"), std::string::npos);
}

TEST_F(SupervisorTest, ACancelledJobStopsAndItsProcessGoesOn) {
  const std::int64_t job = server_.Queue(Misbehaviour::kUntilCancelled);
  const std::int64_t next = server_.Queue(Misbehaviour::kNone);
  server_.verdicts[job] = LeaseVerdict::kCancel;
  EXPECT_EQ(Run(), ExitCode::kOk);
  EXPECT_EQ(server_.results[job].outcome, Code(ReportedOutcome::kCancelled));
  EXPECT_EQ(server_.results[job].exit_signal, 0) << "not killed";
  EXPECT_EQ(server_.results[next].outcome, Code(ReportedOutcome::kFinished));
}

TEST_F(SupervisorTest, ACancelledJobThatDoesNotListenIsKilled) {
  const std::int64_t job = server_.Queue(Misbehaviour::kLoop);
  server_.verdicts[job] = LeaseVerdict::kCancel;
  EXPECT_EQ(Run(), ExitCode::kOk);
  EXPECT_EQ(server_.results[job].outcome, Code(ReportedOutcome::kCancelled));
}

TEST_F(SupervisorTest, APoisonousJobLeavesItsNeighboursAlone) {
  for (int i = 0; i < 40; ++i) server_.Queue(i % 10 == 5 ? Misbehaviour::kSegfault : Misbehaviour::kNone);
  EXPECT_EQ(Run(2), ExitCode::kOk);
  int crashed = 0;
  for (const auto& [id, result] : server_.results) crashed += result.outcome == Code(ReportedOutcome::kCrashed) ? 1 : 0;
  EXPECT_EQ(server_.results.size(), 40U);
  EXPECT_EQ(crashed, 4);
}

TEST_F(SupervisorTest, AnUnusableDatasetIsAUsageError) {
  EXPECT_EQ(Run(2, "input_error"), ExitCode::kUsage);
  EXPECT_NE(log_.str().find("robot.urdf: link: no such link (got 'elbow'); check the name"), std::string::npos)
      << log_.str();
}

TEST_F(SupervisorTest, ProcessesThatCannotStartEndTheWorkerWithEvidence) {
  EXPECT_EQ(Run(1, "crash"), ExitCode::kInternal);
  EXPECT_NE(log_.str().find("about to crash at start"), std::string::npos) << log_.str();
  EXPECT_EQ(Run(1, "garbage"), ExitCode::kInternal);
}

TEST_F(SupervisorTest, AMissingProgramEndsTheWorker) {
  SupervisorOptions options;
  options.pool = TestPoolOptions(1);
  options.child_command = {"/nonexistent/program"};
  spdlog::logger logger("test", std::make_shared<spdlog::sinks::ostream_sink_st>(log_));
  EXPECT_EQ(Supervisor(server_, options, logger).Run(), ExitCode::kMachine);
  EXPECT_NE(log_.str().find("/nonexistent/program"), std::string::npos) << log_.str();
}

TEST_F(SupervisorTest, SignalsDrainThenKill) {
  server_.Queue(Misbehaviour::kLoop);
  std::array<int, 2> pipe_ends{};
  ASSERT_EQ(pipe(pipe_ends.data()), 0);
  SupervisorOptions options;
  options.pool = TestPoolOptions(1);
  options.pool.kill_limit = seconds(60);
  options.child_command = {MisbehavingProcess(), std::to_string(getpid()), "ok"};
  spdlog::logger logger("test", std::make_shared<spdlog::sinks::ostream_sink_st>(log_));
  Supervisor supervisor(server_, options, logger);
  const auto take_order = [&] {
    char order = 0;
    return read(pipe_ends[0], &order, 1) == 1;
  };
  server_.on_wait = [&] {
    // Sends two signals at once when the job runs.
    if (supervisor.pool().num_running() == 1) {
      EXPECT_EQ(write(pipe_ends[1], "xx", 2), 2);
      server_.on_wait = nullptr;
    }
  };
  EXPECT_EQ(supervisor.Run(pipe_ends[0], take_order), ExitCode::kInterrupted);
  EXPECT_EQ(supervisor.child_pid(0), -1);
  EXPECT_TRUE(server_.results.empty());
  EXPECT_EQ(server_.given_back.size(), 1U);
}

TEST(OrphanTest, NoJobProcessOutlivesItsKilledSupervisor) {
  std::array<int, 2> out{};
  ASSERT_EQ(pipe(out.data()), 0);
  const std::string program = MisbehavingProcess();
  const pid_t supervisor = fork();
  if (supervisor == 0) {
    dup2(out[1], STDOUT_FILENO);
    execl(program.c_str(), program.c_str(), "supervise", static_cast<char*>(nullptr));
    _exit(127);
  }
  close(out[1]);
  std::FILE* lines = fdopen(out[0], "r");
  pid_t job_process = 0;
  ASSERT_EQ(std::fscanf(lines, "%d", &job_process), 1);
  const int end = static_cast<int>(syscall(SYS_pidfd_open, job_process, 0));
  ASSERT_GE(end, 0);
  kill(supervisor, SIGKILL);
  pollfd descriptor{end, POLLIN, 0};
  EXPECT_EQ(poll(&descriptor, 1, 60'000), 1) << "still there after a minute";
  waitpid(supervisor, nullptr, 0);
  std::fclose(lines);
  close(end);
}

}  // namespace
}  // namespace legopt::worker

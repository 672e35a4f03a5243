#include "app/isolated_call.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <new>
#include <thread>
#include <vector>

namespace legopt::test {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

/// Returns the reason for which a call failed; empty if it returned.
std::string FaultOf(const std::function<std::string()>& body, const ReadLimits& limits = {}) {
  try {
    CallIsolated(body, limits);
  } catch (const GuardedReadError& failure) {
    return failure.what();
  }
  return {};
}

TEST(CallIsolated, GivesTheAnswerWhateverItsBytes) {
  constexpr std::size_t kMuch = 3'000'000;  // far more than a pipe holds
  std::string bytes(kMuch, '\0');
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<char>(i * 7);
  EXPECT_EQ(CallIsolated([&bytes] { return bytes; }, {}), bytes);
  EXPECT_EQ(CallIsolated([] { return std::string(); }, {}), "");
}

TEST(CallIsolated, RunsInAnotherProcessThatChangesNothingHere) {
  int value = 1;
  const std::string other = CallIsolated(
      [&value] {
        value = 2;
        return std::to_string(::getpid());
      },
      {});
  EXPECT_EQ(value, 1);
  EXPECT_NE(other, std::to_string(::getpid()));
}

TEST(CallIsolated, CrashesAreFailures) {
  EXPECT_THAT(FaultOf([]() -> std::string {
                std::raise(SIGSEGV);
                return "survived";
              }),
              StartsWith("it ended with signal 11, SIGSEGV"));
  EXPECT_THAT(FaultOf([]() -> std::string { std::abort(); }), StartsWith("it ended with signal 6"));
  EXPECT_THAT(FaultOf([]() -> std::string { ::_exit(7); }), HasSubstr("exit code 7"));
}

TEST(CallIsolated, LeavingWithoutAnAnswerIsNotAnEmptyAnswer) {
  EXPECT_NE(FaultOf([]() -> std::string { ::_exit(0); }), "");
}

TEST(CallIsolated, ExceptionsAreFailuresWithTheirText) {
  EXPECT_EQ(FaultOf([]() -> std::string { throw std::runtime_error("no such luck"); }), "no such luck");
  EXPECT_EQ(FaultOf([]() -> std::string { throw 7; }), "it threw an exception");
  EXPECT_THAT(FaultOf([]() -> std::string { throw std::bad_alloc(); }), HasSubstr("MiB of memory"));
}

TEST(CallIsolated, MemoryBeyondTheLimitIsAFailure) {
  ReadLimits limits;
  limits.memory_bytes = std::int64_t{64} << 20;
  const auto take = [](std::size_t bytes) {
    return [bytes] {
      const std::vector<char> taken(bytes, 'x');
      return std::string(1, taken[bytes / 2]);
    };
  };
  EXPECT_EQ(FaultOf(take(std::size_t{16} << 20), limits), "");
  EXPECT_NE(FaultOf(take(std::size_t{256} << 20), limits), "");
}

TEST(CallIsolated, TimeBeyondTheLimitsIsAFailure) {
  ReadLimits limits;
  limits.cpu_s = 1;
  const auto busy = []() -> std::string {
    for (volatile unsigned i = 0;;) {
      const unsigned next = i + 1;
      i = next;
    }
  };
  EXPECT_THAT(FaultOf(busy, limits), HasSubstr("more than 1 s of CPU time"));
  limits.wall_s = 1;
  const auto idle = []() -> std::string {
    for (;;) ::pause();
  };
  EXPECT_THAT(FaultOf(idle, limits), HasSubstr("more than 1 s"));
}

TEST(CallIsolated, PrintsNothing) {
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  CallIsolated(
      [] {
        std::printf("out\n");
        std::fprintf(stderr, "error\n");
        std::fflush(stdout);
        return std::string();
      },
      {});
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

TEST(CallIsolated, ThreadsCallAtTheSameTime) {
  std::vector<std::thread> threads;
  std::vector<std::string> answers(8);
  for (std::size_t i = 0; i < answers.size(); ++i) {
    threads.emplace_back([i, &answers] {
      for (int k = 0; k < 20; ++k)
        answers[i] = CallIsolated([i] { return std::string(100'000, static_cast<char>('a' + i)); }, {});
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (std::size_t i = 0; i < answers.size(); ++i)
    EXPECT_EQ(answers[i], std::string(100'000, static_cast<char>('a' + i)));
}

}  // namespace
}  // namespace legopt::test

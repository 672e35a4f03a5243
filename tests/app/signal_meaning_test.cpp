// Policy: every signal that ends a process is named, also when a shell reports it as an exit code.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>

#include "app/processes.h"

namespace legopt::app {
namespace {

using ::testing::StartsWith;

TEST(SignalMeaning, EverySignalHasAName) {
  EXPECT_EQ(SignalMeaning(SIGKILL), "SIGKILL (killed from outside, perhaps because the machine ran out of memory)");
  EXPECT_EQ(SignalMeaning(SIGALRM), "SIGALRM (Alarm clock)");
  EXPECT_EQ(SignalMeaning(SIGRTMIN + 3), "SIGRTMIN+3 (real-time signal)");
  for (int signal = 1; signal <= SIGRTMAX; ++signal) EXPECT_THAT(SignalMeaning(signal), StartsWith("SIG"));
}

TEST(SignalMeaning, AShellReportsASignalAsAnExitCode) {
  EXPECT_EQ(ExitCodeMeaning(3), "exit code 3");
  EXPECT_EQ(ExitCodeMeaning(127), "exit code 127");
  EXPECT_EQ(ExitCodeMeaning(128), "exit code 128");
  EXPECT_EQ(ExitCodeMeaning(128 + SIGSEGV), "exit code 139, with which a shell reports SIGSEGV (segmentation fault)");
  EXPECT_EQ(ExitCodeMeaning(255), "exit code 255");
}

}  // namespace
}  // namespace legopt::app

// Policy: a child never outlives its parent, its exit status is reported unchanged, and its last output is kept.
#include "client/service/child_process.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include "client/client_error.h"

namespace legopt::client {
namespace {

using std::chrono::milliseconds;
constexpr milliseconds kLong{60'000};  // upper bound for a broken program; not waited for

std::vector<std::string> Script(const std::string& text) { return {"-c", text}; }

TEST(ChildProcess, ReportsItsExitCode) {
  ChildProcess child("/bin/sh", Script("exit 7"), true);
  const auto exit = child.Wait(kLong);
  ASSERT_TRUE(exit.has_value());
  EXPECT_EQ(exit->code, 7);
  EXPECT_EQ(exit->signal, 0);
  EXPECT_EQ(exit->Describe(), "exit code 7");
}

TEST(ChildProcess, ReportsTheSignalThatKilledIt) {
  ChildProcess child("/bin/sh", Script("kill -9 $$"), true);
  const auto exit = child.Wait(kLong);
  ASSERT_TRUE(exit.has_value());
  EXPECT_EQ(exit->signal, SIGKILL);
  EXPECT_THAT(exit->Describe(), testing::HasSubstr("signal 9"));
}

TEST(ChildProcess, WaitsForAWholeLine) {
  ChildProcess child("/bin/sh", Script("printf 'not yet\\nrea'; printf 'dy now\\n'; read x"), true);
  EXPECT_TRUE(child.WaitForLine("ready", kLong));
}

TEST(ChildProcess, NoLineWhenItEndsFirst) {
  ChildProcess child("/bin/sh", Script("echo something; exit 6"), true);
  EXPECT_FALSE(child.WaitForLine("ready", kLong));
  EXPECT_EQ(child.Poll()->code, 6);
}

TEST(ChildProcess, KeepsItsLastWords) {
  ChildProcess child("/bin/sh", Script("echo first >&2; echo 'program: error: no space' >&2; exit 6"), true);
  child.Wait(kLong);
  EXPECT_EQ(child.ErrorTail(), "first\nprogram: error: no space");
}

TEST(ChildProcess, StandardInputIsEmpty) {
  ChildProcess child("/bin/sh", Script("read line && exit 1; exit 0"), true);
  EXPECT_EQ(child.Wait(kLong)->code, 0);
}

TEST(ChildProcess, StopTerminates) {
  ChildProcess child("/bin/sh", Script("trap 'exit 3' TERM; echo ready; while :; do sleep 0.01; done"), true);
  ASSERT_TRUE(child.WaitForLine("ready", kLong));
  EXPECT_EQ(child.Stop(kLong).code, 3);
}

TEST(ChildProcess, StopKillsWhatDoesNotListen) {
  ChildProcess child("/bin/sh", Script("trap '' TERM; echo ready; while :; do sleep 0.01; done"), true);
  ASSERT_TRUE(child.WaitForLine("ready", kLong));
  EXPECT_EQ(child.Stop(kLong, [] { return true; }).signal, SIGKILL);
}

TEST(ChildProcess, DestructorEndsIt) {
  pid_t pid = 0;
  {
    ChildProcess child("/bin/sh", Script("echo ready; exec sleep 1000"), true);
    ASSERT_TRUE(child.WaitForLine("ready", kLong));
    pid = child.pid();
    EXPECT_EQ(::kill(pid, 0), 0);
  }
  EXPECT_EQ(::kill(pid, 0), -1);
}

TEST(ChildProcess, StandsInAGroupOfItsOwn) {
  ChildProcess child("/bin/sh", Script("echo ready; exec sleep 1000"), true);
  ASSERT_TRUE(child.WaitForLine("ready", kLong));
  EXPECT_EQ(::getpgid(child.pid()), child.pid());
}

TEST(ChildProcess, MissingProgramIsNamed) {
  try {
    ChildProcess child("/nowhere/legopt-server", {}, true);
    FAIL();
  } catch (const ClientError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("/nowhere/legopt-server"));
  }
}

}  // namespace
}  // namespace legopt::client

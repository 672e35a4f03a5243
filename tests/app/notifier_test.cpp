// Policy: a Notifier never waits, starts one process at a time without a shell, and drops messages rather than
// growing.

#include "app/notifier.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include "legopt/types/input_error.h"
#include "tests/temporary_folder.h"

namespace legopt::app {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

class NotifierTest : public testing::Test {
 protected:
  std::string Script(const std::string& body) {
    const std::filesystem::path file = folder_ / "notify";
    std::ofstream(file) << "#!/bin/sh\n" << body << "\n";
    ::chmod(file.c_str(), 0700);
    return file.string();
  }
  std::string Written() {
    std::ifstream file(folder_ / "out");
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
  }
  static std::string WorkUntilIdle(Notifier& notifier) {
    std::string faults;
    while (!notifier.idle()) {
      faults += notifier.Work();
      std::this_thread::sleep_for(5ms);
    }
    return faults;
  }

  test::TemporaryFolder folder_;
  NotifierLimits quick_{.pause = 0ms, .longest = 20s};
};

TEST_F(NotifierTest, TheTextIsTheStandardInputAndNoShellReadsTheCommand) {
  Notifier notifier(Script("{ echo \"[$1]\"; cat; } >> " + (folder_ / "out").string()) + " $HOME;id", quick_);
  notifier.Add("{\"kind\":\"one\"}\n");
  notifier.Add("{\"kind\":\"two\"}\n");
  EXPECT_EQ(WorkUntilIdle(notifier), "");
  EXPECT_EQ(Written(), "[$HOME;id]\n{\"kind\":\"one\"}\n[$HOME;id]\n{\"kind\":\"two\"}\n");
}

TEST_F(NotifierTest, ACommandThatHangsIsKilledAndTheNextOneStarts) {
  Notifier notifier(Script("sleep 1000"), {.pause = 0ms, .longest = 50ms});
  notifier.Add("a");
  EXPECT_THAT(WorkUntilIdle(notifier), HasSubstr("was killed"));
}

TEST_F(NotifierTest, AFailureIsReported) {
  Notifier notifier(Script("exit 7"), quick_);
  notifier.Add("a");
  EXPECT_THAT(WorkUntilIdle(notifier), HasSubstr("ended with exit code 7"));
}

TEST_F(NotifierTest, ASignalIsNamed) {
  Notifier notifier(Script("kill -SEGV $$"), quick_);
  notifier.Add("a");
  EXPECT_THAT(WorkUntilIdle(notifier), HasSubstr("was ended by SIGSEGV (segmentation fault)"));
}

TEST_F(NotifierTest, WhatCannotWaitIsDroppedAndCounted) {
  Notifier notifier(Script("cat >/dev/null"), {.pause = 1h, .longest = 20s, .most_waiting = 2});
  for (int i = 0; i < 10; ++i) notifier.Add("a");
  EXPECT_EQ(notifier.dropped(), 8U);
  EXPECT_THAT(notifier.Work(), HasSubstr("8 events dropped"));
  for (int i = 0; i < 20; ++i) notifier.Work();
  EXPECT_FALSE(notifier.idle()) << "the second one waits for its hour";
}

TEST_F(NotifierTest, AMissingProgramIsAnErrorAtTheStart) {
  EXPECT_THROW(Notifier("/nowhere/notify"), InputError);
  EXPECT_THROW(Notifier("no-such-program-anywhere x"), InputError);
  EXPECT_THROW(Notifier(""), InputError);
}

}  // namespace
}  // namespace legopt::app

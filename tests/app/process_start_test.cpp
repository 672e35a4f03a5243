// Policy: a program starts with the same descriptors, signals and limits under every parent. Each case runs in a
// separate process.

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <string>
#include <system_error>

#include "app/isolated_call.h"
#include "app/processes.h"

namespace legopt::app {
namespace {

using ::testing::HasSubstr;

bool IsIgnored(int signal) {
  struct sigaction action {};
  return ::sigaction(signal, nullptr, &action) == 0 && action.sa_handler == SIG_IGN;
}

std::string Digits(std::initializer_list<bool> facts) {
  std::string text;
  for (const bool fact : facts) text += fact ? '1' : '0';
  return text;
}

void LimitDescriptors(rlim_t soft, rlim_t hard) {
  const rlimit limit{soft, hard};
  ::setrlimit(RLIMIT_NOFILE, &limit);
}

TEST(ProcessStart, ClosedDescriptorsAreOccupiedAndStayUnusable) {
  for (int closed = 0; closed < 8; ++closed) {
    const std::string found = CallIsolated(
        [closed] {
          for (int fd = 0; fd < 3; ++fd) {
            if ((closed >> fd & 1) != 0) ::close(fd);
          }
          PrepareProcess(ProcessKind::kService);
          char byte = 'x';
          const bool reads = ::read(STDIN_FILENO, &byte, 1) >= 0;
          const bool in_refused = !reads && errno == EBADF;
          const int next = ::open("/dev/null", O_RDONLY);
          std::string text = next > STDERR_FILENO ? "above" : "below";
          if ((closed & 1) != 0 && !in_refused) text += ", input can be read";
          for (int fd = 1; fd < 3; ++fd) {
            const bool written = ::write(fd, &byte, 1) == 1;
            if (written != ((closed >> fd & 1) == 0)) text += ", output " + std::to_string(fd) + " differs";
          }
          return text;
        },
        {});
    EXPECT_EQ(found, "above") << "closed: " << closed;
  }
}

TEST(ProcessStart, SignalsAreThoseOfTheKind) {
  const auto after = [](ProcessKind kind) {
    return CallIsolated(
        [kind] {
          for (const int signal : {SIGPIPE, SIGUSR1, SIGXFSZ}) std::signal(signal, SIG_DFL);
          std::signal(SIGCHLD, SIG_IGN);
          sigset_t all, now;
          sigfillset(&all);
          sigprocmask(SIG_BLOCK, &all, nullptr);
          PrepareProcess(kind);
          sigprocmask(SIG_BLOCK, nullptr, &now);
          return Digits({IsIgnored(SIGXFSZ), IsIgnored(SIGPIPE), IsIgnored(SIGUSR1), IsIgnored(SIGCHLD),
                         sigismember(&now, SIGTERM) == 1});
        },
        {});
  };
  EXPECT_EQ(after(ProcessKind::kService), "11100");
  EXPECT_EQ(after(ProcessKind::kCommand), "11000") << "a closed pipe is an error of a write";
  EXPECT_EQ(after(ProcessKind::kJob), "10001") << "the supervisor has set the mask";
}

TEST(ProcessStart, AChildIsHandedWhatThisProgramFound) {
  const std::string found = CallIsolated(
      [] {
        rlimit limit{};
        ::getrlimit(RLIMIT_NOFILE, &limit);
        LimitDescriptors(100, limit.rlim_max);
        std::signal(SIGHUP, SIG_IGN);
        std::signal(SIGINT, SIG_IGN);
        std::signal(SIGPIPE, SIG_DFL);
        PrepareProcess(ProcessKind::kService);
        rlimit raised{}, restored{};
        ::getrlimit(RLIMIT_NOFILE, &raised);
        RestoreStartState();
        ::getrlimit(RLIMIT_NOFILE, &restored);
        return Digits({raised.rlim_cur == limit.rlim_max, restored.rlim_cur == 100, IsIgnored(SIGHUP),
                       IsIgnored(SIGINT), IsIgnored(SIGPIPE), IsIgnored(SIGXFSZ)});
      },
      {});
  EXPECT_EQ(found, "111000");
}

TEST(ProcessStart, TheProcessorTimeLimitEndsWithItsOwnSignal) {
  const std::string found = CallIsolated(
      [] {
        const rlimit both{8, 8};  // below that of an isolated call
        ::setrlimit(RLIMIT_CPU, &both);
        PrepareProcess(ProcessKind::kService);
        rlimit separate{}, restored{};
        ::getrlimit(RLIMIT_CPU, &separate);
        RestoreStartState();
        ::getrlimit(RLIMIT_CPU, &restored);
        return Digits({separate.rlim_cur == 7, separate.rlim_max == 8, restored.rlim_cur == 8});
      },
      {});
  EXPECT_EQ(found, "111");
}

TEST(ProcessStart, TermEndsAProgramAlthoughTheParentIgnoredIt) {
  for (const ProcessKind kind : {ProcessKind::kCommand, ProcessKind::kService}) {
    const std::string found = CallIsolated(
        [kind] {
          std::signal(SIGTERM, SIG_IGN);
          PrepareProcess(kind);
          return Digits({IsIgnored(SIGTERM)});
        },
        {});
    EXPECT_EQ(found, "0");
  }
}

TEST(ProcessStart, TooFewDescriptorsAreRefusedWithTheirNumber) {
  for (const rlim_t limit : {rlim_t{6}, rlim_t{20}, rlim_t{kFewestDescriptors}}) {
    const std::string found = CallIsolated(
        [limit]() -> std::string {
          LimitDescriptors(limit, limit);
          try {
            PrepareProcess(ProcessKind::kCommand);
          } catch (const std::system_error& error) {
            return std::to_string(error.code().value() == EMFILE ? 1 : 0) + error.what();
          }
          return "no fault";
        },
        {});
    EXPECT_THAT(found, HasSubstr("1only "));
    EXPECT_THAT(found, HasSubstr("'ulimit -n' (now " + std::to_string(limit) + ")"));
  }
}

TEST(ProcessStart, TheProgramKnowsItsFile) {
  EXPECT_TRUE(ProgramFile().is_absolute());
  EXPECT_EQ(ProgramFile().filename(), "programs_test");
}

}  // namespace
}  // namespace legopt::app

// Signals that request a stop. Each case runs in a separate process, which sends them to itself.

#include "app/stop_signals.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <initializer_list>
#include <string>

#include "app/isolated_call.h"

namespace legopt::test {
namespace {

// Returns "1" for each signal that was interpreted as a stop request, "0" for the others. `hangup` is the initial
// action of SIGHUP.
std::string Taken(std::initializer_list<int> signals, bool owned_by_another = false, void (*hangup)(int) = SIG_DFL) {
  return CallIsolated(
      [&] {
        std::signal(SIGHUP, hangup);
        std::signal(SIGINT, SIG_DFL);  // ignored if a script runs the tests in the background
        app::StopSignals stop(owned_by_another ? ::getppid() : 0);
        std::string taken;
        for (const int signal : signals) {
          ::kill(::getpid(), signal);
          taken += stop.Take() ? '1' : '0';
        }
        return taken;
      },
      {});
}

TEST(StopSignals, InterruptTerminateAndHangupAreOrders) { EXPECT_EQ(Taken({SIGINT, SIGTERM, SIGHUP}), "111"); }

TEST(StopSignals, WarningsAndClosedPipesNeitherStopNorKill) { EXPECT_EQ(Taken({SIGUSR1, SIGUSR2, SIGPIPE}), "000"); }

TEST(StopSignals, AHangupThatIsIgnoredStaysIgnored) { EXPECT_EQ(Taken({SIGHUP, SIGTERM}, false, SIG_IGN), "01"); }

TEST(StopSignals, AnIgnoredInterruptStaysIgnoredAndTerminationIsAlwaysAnOrder) {
  const std::string taken = CallIsolated(
      [] {
        for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, SIG_IGN);
        app::StopSignals stop;
        ::kill(::getpid(), SIGINT);
        const std::string interrupted = stop.Take() ? "1" : "0";
        ::kill(::getpid(), SIGTERM);
        return interrupted + (stop.Take() ? "1" : "0");
      },
      {});
  EXPECT_EQ(taken, "01");
}

TEST(StopSignals, WithAnOwnerNobodyElseGivesOrders) {
  EXPECT_EQ(Taken({SIGINT, SIGTERM, SIGHUP}, true), "000");
  const std::string own = CallIsolated(
      [] {
        app::StopSignals stop(::getpid());
        ::kill(::getpid(), SIGTERM);
        return std::string(stop.Take() ? "1" : "0");
      },
      {});
  EXPECT_EQ(own, "1");
}

TEST(StopSignals, EachOrderIsTakenOnce) {
  const std::string taken = CallIsolated(
      [] {
        std::signal(SIGINT, SIG_DFL);
        app::StopSignals stop;
        ::kill(::getpid(), SIGTERM);
        ::kill(::getpid(), SIGINT);
        std::string each;
        for (int i = 0; i < 3; ++i) each += stop.Take() ? '1' : '0';
        return each;
      },
      {});
  EXPECT_EQ(taken, "110");
}

}  // namespace
}  // namespace legopt::test

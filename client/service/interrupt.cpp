#include "client/service/interrupt.h"

#include <signal.h>

#include <array>

namespace legopt::client {
namespace {

constexpr std::array<int, 3> kSignals = {SIGINT, SIGTERM, SIGHUP};
volatile sig_atomic_t interrupt_count = 0;
std::array<struct sigaction, kSignals.size()> previous_actions;

void CountSignal(int /*number*/) { interrupt_count = interrupt_count + 1; }

}  // namespace

InterruptGuard::InterruptGuard() {
  interrupt_count = 0;
  struct sigaction action {};
  action.sa_handler = CountSignal;  // without SA_RESTART: a waiting call returns early
  for (std::size_t i = 0; i < kSignals.size(); ++i) ::sigaction(kSignals[i], &action, &previous_actions[i]);
}

InterruptGuard::~InterruptGuard() {
  for (std::size_t i = 0; i < kSignals.size(); ++i) ::sigaction(kSignals[i], &previous_actions[i], nullptr);
}

int InterruptCount() { return interrupt_count; }

}  // namespace legopt::client

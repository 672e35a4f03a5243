#include "client/service/interrupt.h"

#include <signal.h>

#include <utility>
#include <vector>

#include "app/stop_signals.h"

namespace legopt::client {
namespace {

volatile sig_atomic_t interrupt_count = 0;
std::vector<std::pair<int, struct sigaction>> previous_actions;

void CountSignal(int /*number*/) { interrupt_count = interrupt_count + 1; }

}  // namespace

InterruptGuard::InterruptGuard() {
  interrupt_count = 0;
  struct sigaction action {};
  action.sa_handler = CountSignal;  // without SA_RESTART: blocking calls return early
  for (const int signal : app::StoppingSignals()) {
    struct sigaction previous {};
    ::sigaction(signal, &action, &previous);
    previous_actions.emplace_back(signal, previous);
  }
}

InterruptGuard::~InterruptGuard() {
  for (const auto& [signal, action] : std::exchange(previous_actions, {})) ::sigaction(signal, &action, nullptr);
}

int InterruptCount() { return interrupt_count; }

}  // namespace legopt::client

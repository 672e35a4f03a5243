#include "app/stop_signals.h"

#include <signal.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace legopt::app {
namespace {

bool IsIgnored(int signal) {
  struct sigaction action {};
  return ::sigaction(signal, nullptr, &action) == 0 && action.sa_handler == SIG_IGN;
}

}  // namespace

std::vector<int> StoppingSignals() {
  std::vector<int> orders = {SIGTERM};
  for (const int signal : {SIGINT, SIGHUP}) {
    if (!IsIgnored(signal)) orders.push_back(signal);
  }
  return orders;
}

StopSignals::StopSignals(pid_t owner) : owner_(owner) {
  for (const int signal : {SIGUSR1, SIGUSR2, SIGPIPE}) ::signal(signal, SIG_IGN);
  sigset_t signals;
  ::sigemptyset(&signals);
  // A blocked signal is kept even if it is ignored.
  for (const int signal : StoppingSignals()) ::sigaddset(&signals, signal);
  ::sigprocmask(SIG_BLOCK, &signals, nullptr);
  descriptor_ = ::signalfd(-1, &signals, SFD_CLOEXEC | SFD_NONBLOCK);
  if (descriptor_ < 0) throw std::system_error(errno, std::generic_category(), "signalfd");
}

StopSignals::~StopSignals() { ::close(descriptor_); }

bool StopSignals::Take() {
  signalfd_siginfo info{};
  while (::read(descriptor_, &info, sizeof(info)) == static_cast<ssize_t>(sizeof(info))) {
    if (owner_ == 0 || static_cast<pid_t>(info.ssi_pid) == owner_) return true;
  }
  return false;
}

}  // namespace legopt::app

#include "app/signal_meaning.h"

#include <csignal>
#include <cstring>

namespace legopt::app {

std::string SignalMeaning(int signal) {
  switch (signal) {
    case SIGSEGV:
      return "SIGSEGV (segmentation fault)";
    case SIGABRT:
      return "SIGABRT (aborted)";
    case SIGBUS:
      return "SIGBUS (bus error)";
    case SIGFPE:
      return "SIGFPE (arithmetic error)";
    case SIGILL:
      return "SIGILL (illegal instruction)";
    case SIGKILL:
      return "SIGKILL (killed from outside, perhaps because the machine ran out of memory)";
    case SIGTERM:
      return "SIGTERM (terminated from outside)";
    case SIGINT:
      return "SIGINT (interrupted from outside)";
    case SIGHUP:
      return "SIGHUP (terminal or session closed)";
    case SIGPIPE:
      return "SIGPIPE (the reader of its output has gone)";
    case SIGSYS:
      return "SIGSYS (forbidden system call)";
    case SIGXCPU:
      return "SIGXCPU (processor time limit, 'ulimit -t')";
    case SIGXFSZ:
      return "SIGXFSZ (file size limit, 'ulimit -f')";
    default:
      break;
  }
  if (signal >= SIGRTMIN && signal <= SIGRTMAX) {
    return "SIGRTMIN+" + std::to_string(signal - SIGRTMIN) + " (real-time signal)";
  }
  const char* const name = ::sigabbrev_np(signal);
  if (name == nullptr) return "SIG" + std::to_string(signal) + " (a signal without a name)";
  return std::string("SIG") + name + " (" + ::sigdescr_np(signal) + ")";
}

std::string ExitCodeMeaning(int code) {
  constexpr int kShellAdds = 128;
  const std::string text = "exit code " + std::to_string(code);
  const int signal = code - kShellAdds;
  if (signal < 1 || signal > SIGRTMAX) return text;
  return text + ", with which a shell reports " + SignalMeaning(signal);
}

}  // namespace legopt::app

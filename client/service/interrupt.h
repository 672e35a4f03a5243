#pragma once

namespace legopt::client {

/// During its lifetime, the signals of app::StoppingSignals request an orderly end instead of killing the process.
/// Only one guard may exist at a time, because signal handlers are process-wide.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;
};

/// Number of such signals since the guard was created: one requests an orderly end, two an immediate one.
int InterruptCount();
inline bool Interrupted() { return InterruptCount() > 0; }
inline bool InterruptedTwice() { return InterruptCount() > 1; }

}  // namespace legopt::client

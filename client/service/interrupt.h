#pragma once

namespace legopt::client {

/// Makes the signals of programs::OrdersToStop ask for an orderly end instead of killing the process, for the guard's
/// lifetime.
/// One guard at a time (signal handlers are process-wide by nature).
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;
};

/// Number of such signals since the guard was made: one asks for an orderly end, two for an immediate one.
int InterruptCount();
inline bool Interrupted() { return InterruptCount() > 0; }
inline bool InterruptedTwice() { return InterruptCount() > 1; }

}  // namespace legopt::client

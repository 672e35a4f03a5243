#pragma once

#include <cstdint>

namespace legopt {

/// Wall time, CPU time and involuntary context switches of the calling thread since construction.
class SolveTimer {
 public:
  SolveTimer();
  std::int64_t wall_us() const;                       ///< by a steady clock
  std::int64_t cpu_us() const;                        ///< of this thread alone
  std::int64_t involuntary_context_switches() const;  ///< of this thread: the processor was taken away

 private:
  std::int64_t wall_start_us_, cpu_start_us_, switches_start_;
};

}  // namespace legopt

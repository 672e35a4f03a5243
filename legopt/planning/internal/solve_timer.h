#pragma once

#include <cstdint>

namespace legopt {

/// Wall time, CPU time and involuntary context switches of the calling thread since construction.
class SolveTimer {
 public:
  SolveTimer();
  std::int64_t wall_us() const;                       ///< steady clock
  std::int64_t cpu_us() const;                        ///< CPU time of this thread only
  std::int64_t involuntary_context_switches() const;  ///< switches at which this thread lost its processor

 private:
  std::int64_t wall_start_us_, cpu_start_us_, switches_start_;
};

}  // namespace legopt

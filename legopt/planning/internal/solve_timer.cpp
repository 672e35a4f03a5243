#include "legopt/planning/internal/solve_timer.h"

#include <sys/resource.h>

#include <ctime>

namespace legopt {
namespace {

std::int64_t Now_us(clockid_t clock) {
  constexpr std::int64_t kMicrosPerSecond = 1'000'000;
  constexpr std::int64_t kNanosPerMicro = 1'000;
  timespec time{};
  clock_gettime(clock, &time);
  return time.tv_sec * kMicrosPerSecond + time.tv_nsec / kNanosPerMicro;
}

std::int64_t Switches() {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_nivcsw;
}

}  // namespace

SolveTimer::SolveTimer()
    : wall_start_us_(Now_us(CLOCK_MONOTONIC)),
      cpu_start_us_(Now_us(CLOCK_THREAD_CPUTIME_ID)),
      switches_start_(Switches()) {}

std::int64_t SolveTimer::wall_us() const { return Now_us(CLOCK_MONOTONIC) - wall_start_us_; }
std::int64_t SolveTimer::cpu_us() const { return Now_us(CLOCK_THREAD_CPUTIME_ID) - cpu_start_us_; }
std::int64_t SolveTimer::involuntary_context_switches() const { return Switches() - switches_start_; }

}  // namespace legopt

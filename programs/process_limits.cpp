#include "programs/process_limits.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace legopt {

void LimitMemoryGrowth(std::int64_t extra_bytes) {
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  if (extra_bytes > 0) {
    // First field of statm: size of the address space in pages.
    long pages = 0;
    if (std::FILE* statm = std::fopen("/proc/self/statm", "re"); statm != nullptr) {
      if (std::fscanf(statm, "%ld", &pages) != 1) pages = 0;
      std::fclose(statm);
    }
    const rlim_t wanted =
        static_cast<rlim_t>(pages) * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)) + static_cast<rlim_t>(extra_bytes);
    limit.rlim_cur = limit.rlim_max == RLIM_INFINITY ? wanted : std::min(wanted, limit.rlim_max);
  }
  setrlimit(RLIMIT_AS, &limit);
}

}  // namespace legopt

#include "app/process_limits.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace legopt {
namespace {

// Without /proc the size is unknown. Assumes more than any program uses, because the limit must not be below the
// current size.
rlim_t AddressSpaceBytes() {
  constexpr rlim_t kUnknown = rlim_t{4} << 30U;
  long pages = 0;  // first field of statm
  std::FILE* const statm = std::fopen("/proc/self/statm", "re");
  if (statm == nullptr) return kUnknown;
  const bool read = std::fscanf(statm, "%ld", &pages) == 1;  // reader: a whole number
  std::fclose(statm);
  return read ? static_cast<rlim_t>(pages) * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)) : kUnknown;
}

}  // namespace

void LimitMemoryGrowth(std::int64_t extra_bytes) {
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  if (extra_bytes > 0) {
    const rlim_t wanted = AddressSpaceBytes() + static_cast<rlim_t>(extra_bytes);
    limit.rlim_cur = limit.rlim_max == RLIM_INFINITY ? wanted : std::min(wanted, limit.rlim_max);
  }
  setrlimit(RLIMIT_AS, &limit);
}

}  // namespace legopt

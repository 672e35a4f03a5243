// Process information of the kernel (/proc). Linux only.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <vector>

namespace legopt::figures {

struct ProcessFacts {
  double resident_mb = 0;  ///< 2^20 bytes
  int descriptors = 0;
  int threads = 0;
  double cpu_s = 0;  ///< user and system, of all its threads so far
};

/// Returns zeros for a process that has ended.
ProcessFacts FactsOf(pid_t pid);
std::vector<pid_t> ChildrenOf(pid_t pid);

/// Waits for the end of any process, child or not.
class EndOf {
 public:
  explicit EndOf(pid_t pid);
  ~EndOf();
  EndOf(const EndOf&) = delete;
  EndOf& operator=(const EndOf&) = delete;
  bool reached() const;

 private:
  int fd_;
};

}  // namespace legopt::figures

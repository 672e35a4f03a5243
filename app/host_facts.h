#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>

namespace legopt::app {

/// Description of the machine, for measured times.
struct HostFacts {
  std::string processor;          ///< model as reported by the kernel; "unknown"
  std::int64_t memory_bytes = 0;  ///< memory of the machine; 0: unknown
};

/// Reads files below `root` (tests use their own tree).
HostFacts ReadHostFacts(const std::filesystem::path& root = "/");

/// Returns the load average: processes that run or wait to run, mean of the last minute, >= 0; NaN: unknown.
double HostLoad(const std::filesystem::path& root = "/");

}  // namespace legopt::app

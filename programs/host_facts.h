#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>

namespace legopt::programs {

/// The machine that a time was measured on.
struct HostFacts {
  std::string processor;          ///< model as the kernel names it; "unknown"
  std::int64_t memory_bytes = 0;  ///< of the machine; 0: unknown
};

/// Files are looked for below `root` (tests bring a tree of their own).
HostFacts ReadHostFacts(const std::filesystem::path& root = "/");

/// Processes that run or wait to run, mean of the last minute (load average); NaN: unknown. >= 0.
double HostLoad(const std::filesystem::path& root = "/");

}  // namespace legopt::programs

#pragma once

#include <cstdint>

#include "bus/spec_limits.h"

/// Limits that several messages share. All are inclusive.
namespace legopt::bus::fields {

inline constexpr std::int64_t kSecond_us = 1'000'000;
inline constexpr std::int64_t kLongestLease_us = 86'400 * kSecond_us;
inline constexpr std::int64_t kMostSlots = 1024;
inline constexpr std::int64_t kMostProcessors = 65'536;
inline constexpr std::int64_t kMostDatasets = 64;
inline constexpr std::int64_t kMostLeases = 4096;
inline constexpr std::int64_t kNameBytes = 256;
inline constexpr std::int64_t kWordBytes = 64;
inline constexpr std::int64_t kTextBytes = 4096;
inline constexpr std::int64_t kOptionsBytes = std::int64_t{1} << 20;
inline constexpr std::int64_t kJsonBytes = spec_limits::kMostBytes;

}  // namespace legopt::bus::fields

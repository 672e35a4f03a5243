#pragma once

#include <cstdint>

#include "bus/spec_limits.h"

/// @file
/// Limits that several messages share. All are inclusive.

namespace legopt::bus::fields {

inline constexpr std::int64_t kSecond_us = 1'000'000;                  ///< in microseconds
inline constexpr std::int64_t kLongestLease_us = 86'400 * kSecond_us;  ///< a day
inline constexpr std::int64_t kMostSlots = 1024;                       ///< of a worker
inline constexpr std::int64_t kMostProcessors = 65'536;                ///< granted to a worker
inline constexpr std::int64_t kMostCapabilities = 256;                 ///< that a worker announces
inline constexpr std::int64_t kMostLeases = 4096;                      ///< in one heartbeat
inline constexpr std::int64_t kNameBytes = 256;                        ///< of a host, a worker, a dataset, a build
inline constexpr std::int64_t kWordBytes = 64;                         ///< of an enumeration, as a text
inline constexpr std::int64_t kTextBytes = 4096;                       ///< of a text for humans
inline constexpr std::int64_t kOptionsBytes = std::int64_t{1} << 20;   ///< of a method's options and of a query's SQL
inline constexpr std::int64_t kMostArchiveBytes = std::int64_t{64} << 20;        ///< size of a dataset's archive
inline constexpr std::int64_t kMostStoredArchiveBytes = std::int64_t{16} << 20;  ///< size of an archive in a database
inline constexpr std::int64_t kMostPieceBytes = std::int64_t{1} << 20;  ///< size of a piece of an archive in one reply
inline constexpr std::int64_t kJsonBytes = spec_limits::kMostBytes;     ///< size of any other JSON text

}  // namespace legopt::bus::fields

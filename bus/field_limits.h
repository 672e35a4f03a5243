#pragma once

#include <cstdint>

#include "bus/spec_limits.h"

/// @file
/// Limits shared by several messages. All are inclusive.

namespace legopt::bus::fields {

inline constexpr std::int64_t kSecond_us = 1'000'000;                  ///< a second in microseconds
inline constexpr std::int64_t kLongestLease_us = 86'400 * kSecond_us;  ///< a day
inline constexpr std::int64_t kMostSlots = 1024;                       ///< slots of a worker
inline constexpr std::int64_t kMaxProcessors = 65'536;                 ///< granted to a worker
inline constexpr std::int64_t kMaxCapabilities = 256;                  ///< capabilities announced by a worker
inline constexpr std::int64_t kMaxViolations = 64;                     ///< values of checks in a result
inline constexpr std::int64_t kMostLeases = 4096;                      ///< leases in one heartbeat
inline constexpr std::int64_t kNameBytes = 256;     ///< length of the name of a host, worker, dataset or build
inline constexpr std::int64_t kEnumNameBytes = 64;  ///< length of an enum name
inline constexpr std::int64_t kTextBytes = 4096;    ///< length of a text for humans
inline constexpr std::int64_t kOptionsBytes = std::int64_t{1} << 20;            ///< length of method options and of SQL
inline constexpr std::int64_t kMaxArchiveBytes = std::int64_t{64} << 20;        ///< size of a dataset's archive
inline constexpr std::int64_t kMaxStoredArchiveBytes = std::int64_t{16} << 20;  ///< size of an archive in a database
inline constexpr std::int64_t kMaxPieceBytes = std::int64_t{1} << 20;  ///< size of a piece of an archive in one reply
inline constexpr std::int64_t kJsonBytes = spec_limits::kMostBytes;    ///< size of any other JSON text

}  // namespace legopt::bus::fields

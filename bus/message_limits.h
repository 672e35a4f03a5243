#pragma once

#include <cstddef>
#include <cstdint>

namespace legopt::bus::spec_limits {

/// @file
/// Limits of an experiment's specification, the `spec_json` of a submission (lcmtypes/PROTOCOL.md, section "Submit").
/// The client, which writes specifications, and the server, which checks them, use the same numbers. All are inclusive.

/// Limits of an experiment.

inline constexpr std::size_t kMostNameBytes = 200;                ///< length of every text; at least 1, without NUL
inline constexpr std::size_t kMostBytes = std::size_t{16} << 20;  ///< size of the specification
inline constexpr std::size_t kMostMethods = 1000;                 ///< methods; at least 1
inline constexpr std::int64_t kMaxJobs = 1'000'000;               ///< jobs of an experiment
inline constexpr std::int64_t kMaxRepetitions = 100'000;          ///< repetitions; at least 1
inline constexpr std::int64_t kMostAttempts = 100;                ///< attempts of a job; at least 1
inline constexpr std::int64_t kMaxProblemId = 1'000'000;          ///< largest problem id; the smallest is 0
inline constexpr std::int64_t kMaxWaypoints = 1'000'000;          ///< waypoints of a problem
inline constexpr std::int64_t kMaxMultiStarts = 1'000'000;        ///< number of random restarts; the smallest is 0
inline constexpr std::int64_t kMaxEffort = 1'000'000'000'000;     ///< term evaluations of a job; at least 1
inline constexpr double kMinWallTime_s = 1e-3;                    ///< wall-time limit of a job
inline constexpr double kMaxWallTime_s = 7 * 86'400.0;            ///< wall-time limit of a job: a week
inline constexpr std::int64_t kMinMemory_mb = 64;                 ///< memory limit of a job, in MiB
inline constexpr std::int64_t kMaxMemory_mb = 1 << 20;            ///< memory limit of a job, in MiB: 1 TiB

}  // namespace legopt::bus::spec_limits

namespace legopt::bus::fields {

// Limits shared by several messages. All are inclusive.

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

#pragma once

#include <cstddef>
#include <cstdint>

/// @file
/// Limits of an experiment's specification, the `spec_json` of a submission (lcmtypes/PROTOCOL.md, section "Submit").
/// The client, which writes specifications, and the server, which checks them, use the same numbers. All are inclusive.

/// Limits of an experiment.
namespace legopt::bus::spec_limits {

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

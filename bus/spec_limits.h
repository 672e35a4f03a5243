#pragma once

#include <cstddef>
#include <cstdint>

/// @file
/// Limits of an experiment's specification, the `spec_json` of a submission (lcmtypes/PROTOCOL.md, section "Submit").
/// Who writes one (client) and who checks it (server) use the same numbers, so that what the one accepts the other does
/// not refuse. All are inclusive.

/// Limits of an experiment.
namespace legopt::bus::spec_limits {

inline constexpr std::size_t kMostNameBytes = 200;                ///< of every text; at least 1, without NUL
inline constexpr std::size_t kMostBytes = std::size_t{16} << 20;  ///< of the specification
inline constexpr std::size_t kMostMethods = 1000;                 ///< at least 1
inline constexpr std::int64_t kMostJobs = 1'000'000;              ///< of an experiment
inline constexpr std::int64_t kMostRepetitions = 100'000;         ///< at least 1
inline constexpr std::int64_t kMostAttempts = 100;                ///< of a job, at least 1
inline constexpr std::int64_t kMostProblemId = 1'000'000;         ///< from 0
inline constexpr std::int64_t kMostWaypoints = 1'000'000;         ///< of a problem
inline constexpr std::int64_t kMostMultiStarts = 1'000'000;       ///< from 0
inline constexpr std::int64_t kMostEffort = 1'000'000'000'000;    ///< of a job, in term evaluations; at least 1
inline constexpr double kLeastWallTime_s = 1e-3;                  ///< of a job
inline constexpr double kMostWallTime_s = 7 * 86'400.0;           ///< of a job: a week
inline constexpr std::int64_t kLeastMemory_mb = 64;               ///< of a job, in MiB
inline constexpr std::int64_t kMostMemory_mb = 1 << 20;           ///< of a job, in MiB: 1 TiB

}  // namespace legopt::bus::spec_limits

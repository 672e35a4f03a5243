#pragma once

#include <cstddef>
#include <cstdint>

#include "db/file_system.h"
#include "db/store.h"

/// @file
/// Sizes that are compared with the scheduler's limits (SchedulerOptions). Thread rule: none, values.

namespace legopt::server {

/// Largest share of a disk that is reserved, so that small disks remain usable.
inline constexpr double kMaxReservedShare = 0.05;

/// Returns the bytes of this disk that submissions leave free: `reserve_bytes`, but at most kMaxReservedShare of the
/// disk.
std::int64_t ReserveOf(const db::DiskSpace& disk, std::int64_t reserve_bytes);

/// Returns the memory used by the summary of an experiment, in bytes.
std::size_t SummaryBytes(const db::ExperimentSummary& summary);

}  // namespace legopt::server

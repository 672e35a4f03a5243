#pragma once

#include <cstddef>
#include <cstdint>

#include "db/file_system.h"
#include "db/store.h"

/// @file
/// Sizes that the scheduler's limits compare (SchedulerOptions). Thread rule: none, values.

namespace legopt::server {

/// Largest share of a disk that is reserved: a small disk is not reserved as a whole.
inline constexpr double kMostReservedShare = 0.05;

/// Bytes of this disk that submissions leave free: `reserve_bytes`, at most kMostReservedShare of the disk.
std::int64_t ReserveOf(const db::DiskSpace& disk, std::int64_t reserve_bytes);

/// Memory of the summary of an experiment, in bytes.
std::size_t SummaryBytes(const db::ExperimentSummary& summary);

}  // namespace legopt::server

#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "server/scheduler.h"

namespace legopt::server {

/// The JSON of a status reply (lcmtypes/PROTOCOL.md): "experiments" with their jobs by state and what they may expect,
/// "workers" online or with leases, "server" with queue lengths and the scheduler's counters. `experiment_id` 0 lists
/// all experiments; one alone is told with its kinds of jobs. `store_error`: why the database cannot be written; empty:
/// it can.
nlohmann::json StatusJson(const Scheduler& scheduler, std::int64_t experiment_id, const Instant& now,
                          const std::string& store_error = {});

}  // namespace legopt::server

#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "server/scheduler.h"

namespace legopt::server {

/// Returns the JSON of a status reply (lcmtypes/PROTOCOL.md): "experiments" with jobs by state and estimates, "workers"
/// that are online or have leases, "server" with queue lengths and the scheduler's counters. `experiment_id` 0 lists
/// all experiments; a single experiment includes its kinds of jobs. `store_error`: why the database cannot be written;
/// empty if it can.
nlohmann::json StatusJson(const Scheduler& scheduler, std::int64_t experiment_id, const Instant& now,
                          const std::string& store_error = {});

}  // namespace legopt::server

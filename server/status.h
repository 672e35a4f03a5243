#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>

#include "server/scheduler.h"

namespace legopt::server {

/// The JSON of a status reply (lcmtypes/PROTOCOL.md): "experiments" with their jobs by state, "workers" online or with
/// leases, "server" with queue lengths and the scheduler's counters. `experiment_id` 0 lists all experiments.
nlohmann::json StatusJson(const Scheduler& scheduler, std::int64_t experiment_id, const Instant& now);

}  // namespace legopt::server

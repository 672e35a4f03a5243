#pragma once

#include <cstdint>

#include "client/report/result_source.h"

namespace legopt::client {

/// The attempts of a job, in their order: attempt, outcome, worker, hostname, build, processor, exit_signal, seconds,
/// leased_utc, message, log_tail (the last lines that its process wrote).
Listing ReadAttempts(ResultSource& source, std::int64_t job_id);

}  // namespace legopt::client

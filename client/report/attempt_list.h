#pragma once

#include <cstdint>

#include "client/report/result_source.h"

namespace legopt::client {

/// Returns the attempts of a job in order: attempt, outcome, worker, hostname, build, processor, exit_signal, seconds,
/// leased_utc, message, log_tail (last lines written by its process).
Listing ReadAttempts(ResultSource& source, std::int64_t job_id);

}  // namespace legopt::client

#pragma once

#include <cstdint>
#include <span>

#include "client/report/result_source.h"
#include "legopt/types/check.h"

namespace legopt::client {

/// Returns values of checks in the order of kChecks: check, rule, value, unit, tolerance, waypoint (null: unknown),
/// subject. An infinite value is null.
Listing ViolationListing(std::span<const Violation> violations);

/// Returns the values of the checks of a job's result, as above; no rows without a result. A check that this build does
/// not know comes last, without unit.
Listing ReadViolations(ResultSource& source, std::int64_t job_id);

}  // namespace legopt::client

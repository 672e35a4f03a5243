#pragma once

#include <string>

#include "db/records.h"
#include "legopt_msg/result_request.hpp"

namespace legopt::server {

/// Maps the reported outcome to the database's enumeration; a released job is reported as kCancelled.
db::AttemptOutcome OutcomeOf(const legopt_msg::result_request& request);

struct ReportedResult {
  db::ResultRecord record;
  std::string fault;  ///< enum name unknown to this program, sent by a worker of another build; empty if valid
};

/// Returns the result of a finished attempt; each column is read from the field with its name. `num_waypoints` is set
/// to the number of waypoints of the solution, at least 1; only the server knows the waypoints of the problem.
ReportedResult ResultOf(const legopt_msg::result_request& request);

}  // namespace legopt::server

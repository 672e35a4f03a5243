#pragma once

#include <string>

#include "db/records.h"
#include "legopt_msg/result_request.hpp"

namespace legopt::server {

/// What an attempt became, in the words of the database: the report of one that was given back says kCancelled.
db::AttemptOutcome OutcomeOf(const legopt_msg::result_request& request);

struct ReportedResult {
  db::ResultRecord record;
  std::string fault;  ///< a word that this program does not know, of a worker of another build; empty: none
};

/// The result in the report of a finished attempt: every column from the field of its name. `num_waypoints` counts the
/// waypoints of the solution, at least 1: only the server knows those of the problem.
ReportedResult ResultOf(const legopt_msg::result_request& request);

}  // namespace legopt::server

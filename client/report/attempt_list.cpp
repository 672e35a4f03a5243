#include "client/report/attempt_list.h"

namespace legopt::client {

Listing ReadAttempts(ResultSource& source, std::int64_t job_id) {
  return source.Query(
      "SELECT attempt, outcome, w.name AS worker, w.hostname, w.build_id AS build, w.processor, exit_signal, "
      "(ended_at_us - leased_at_us) / 1e6 AS seconds, strftime('%Y-%m-%d %H:%M:%S', leased_at_us / 1000000, "
      "'unixepoch') AS leased_utc, message, log_tail FROM attempts JOIN workers AS w USING (worker_id) WHERE job_id "
      "= " +
      std::to_string(job_id) + " ORDER BY attempt");
}

}  // namespace legopt::client

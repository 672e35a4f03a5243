#include "client/report/attempt_list.h"

#include "db/named_queries.h"

namespace legopt::client {

Listing ReadAttempts(ResultSource& source, std::int64_t job_id) {
  return source.Query(db::Sql(db::Query::kAttemptsOfJob, {{"job_id", job_id}}));
}

}  // namespace legopt::client

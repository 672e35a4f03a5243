#pragma once

#include <cstdint>
#include <vector>

#include "client/report/listing.h"
#include "client/report/result_source.h"
#include "legopt/optimize/solve_outcome.h"

namespace legopt::client {

/// How the solve of a job converged, as the database has it.
struct StoredTrace {
  std::vector<IterationRecord> records;  ///< empty: `history` has what there is
  /// Of results made before schema version 7: a row per penalty value, in the columns of then.
  Listing history;
};

/// The records in column "trace" of the first row; none for NULL or an empty BLOB. Throws ClientError
/// (kDatabaseUnusable) if they cannot be decoded.
std::vector<IterationRecord> TraceRecords(const Listing& row, std::int64_t job);

/// Reads it. Throws ClientError: kUsage for a job that does not exist, has no result or no trace, kDatabaseUnusable for
/// one that is damaged.
StoredTrace ReadTrace(ResultSource& source, std::int64_t job);

/// One row per record: step, window, restart, start, penalty, trust_box, accepted, evaluations, elapsed_us, cost,
/// violation.
Listing TraceListing(const std::vector<IterationRecord>& records);

}  // namespace legopt::client

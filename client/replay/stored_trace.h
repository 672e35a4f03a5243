#pragma once

#include <cstdint>
#include <vector>

#include "client/report/listing.h"
#include "client/report/result_source.h"
#include "legopt/solvers/solve_outcome.h"

namespace legopt::client {

/// The stored convergence of a job's solve.
struct StoredTrace {
  std::vector<IterationRecord> records;  ///< empty: see `history`
  /// Trace of results made before schema version 7: a row per penalty value, with the columns of that version.
  Listing history;
};

/// Decodes the records in column "trace" of the first row; empty for NULL or an empty BLOB. Throws ClientError
/// (kDatabaseUnusable) if they cannot be decoded.
std::vector<IterationRecord> TraceRecords(const Listing& row, std::int64_t job);

/// Reads the trace of a job. Throws ClientError: kUsage if the job does not exist or has no result or no trace,
/// kDatabaseUnusable if the trace is damaged.
StoredTrace ReadTrace(ResultSource& source, std::int64_t job);

/// Returns one row per record: step, window, restart, start, penalty, trust_box, accepted, evaluations, elapsed_us,
/// cost, violation.
Listing TraceListing(const std::vector<IterationRecord>& records);

}  // namespace legopt::client

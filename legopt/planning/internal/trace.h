#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "legopt/solvers/solver.h"

namespace legopt {

/// @file
/// Convergence of a solve, small enough to be stored with every result: the relevant records, compressed. The layout of
/// the bytes is described in docs/reference/database.md, "Traces". Values; any thread.

/// Maximum number of records in a stored trace: at most a quarter of a megabyte before compression, some tens of
/// kilobytes after it.
inline constexpr std::size_t kMaxTraceRecords = 4000;

/// Returns the relevant records of a solve, in their order. A record is kept if it is better than all before it in its
/// window: a smaller violation or, among points that are feasible within a tolerance that solvers may have, a lower
/// cost. Hence the curve of the best point so far is that of the whole history. The last accepted record of every
/// window, restart, start and penalty is also kept. If there are more than `most` (>= 2), as many evenly spaced ones
/// are returned, including the first and the last accepted one.
std::vector<IterationRecord> CondenseTrace(std::span<const IterationRecord> history,
                                           std::size_t most = kMaxTraceRecords);

/// Returns the records as bytes, with the times apart from all that is identical in every repetition. No records give
/// no bytes.
std::vector<std::uint8_t> EncodeTrace(std::span<const IterationRecord> records);

/// Returns the records passed to EncodeTrace. Throws InputError, with `source` as the file, for bytes that it cannot
/// have written.
std::vector<IterationRecord> DecodeTrace(std::span<const std::uint8_t> bytes, const std::string& source);

}  // namespace legopt

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "legopt/optimize/solve_outcome.h"

namespace legopt {

/// @file
/// How a solve converged, small enough to be kept with every result: the records that matter, compressed. The layout
/// of the bytes stands in docs/database.md, "Traces". Thread rule: none, values.

/// Most records of a trace that is kept: at most a quarter of a megabyte before compression, some tens of kilobytes
/// after it.
inline constexpr std::size_t kMostTraceRecords = 4000;

/// Of all records of a solve those that matter, in their order: each one that is better than all before it in its
/// window - a smaller violation or, among points that are feasible under a tolerance that solvers may have, a lower
/// cost - so that the curve of the best so far is that of the whole history; and the last accepted one of every window,
/// restart, start and penalty. Of more than `most` (>= 2) as many, evenly spaced, the first and the last accepted one
/// among them.
std::vector<IterationRecord> CondenseTrace(std::span<const IterationRecord> history,
                                           std::size_t most = kMostTraceRecords);

/// The records as bytes, the times apart from all that is the same in every repetition; no bytes for no records.
std::vector<std::uint8_t> EncodeTrace(std::span<const IterationRecord> records);

/// What EncodeTrace was given. Throws InputError, with `source` for the file, for bytes that it cannot have written.
std::vector<IterationRecord> DecodeTrace(std::span<const std::uint8_t> bytes, const std::string& source);

}  // namespace legopt

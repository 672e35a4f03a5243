#pragma once

#include <cstdint>
#include <string>

#include "client/report/table.h"

namespace legopt::client {

/// Formats the number of starts: "10", or "0 + 8 inside" with internal restarts.
std::string FormatStarts(std::int64_t multi_starts, std::int64_t inner_starts);
/// Returns a cell with the number of starts, as formatted by FormatStarts.
TableCell ShownStarts(std::int64_t multi_starts, std::int64_t inner_starts);

}  // namespace legopt::client

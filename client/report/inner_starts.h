#pragma once

#include <cstdint>
#include <string>

#include "client/report/grouped_table.h"

namespace legopt::client {

/// Formats the number of starts: "10", or "0 + 8 inside" with internal restarts. Brief: "0+8".
TableText FormatStarts(std::int64_t multi_starts, std::int64_t inner_starts);

}  // namespace legopt::client

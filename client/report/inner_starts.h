#pragma once

#include <cstdint>
#include <string>

#include "client/report/grouped_table.h"

namespace legopt::client {

/// SQL for the number of further starts that a method may make inside one attempt, where `alias` stands for its row of
/// `methods`: LegOpt-best's option `rescues` (docs/suites.md), 0 for methods without.
std::string InnerStartsSql(const std::string& alias);

/// How often a method may start: "10", or "0 + 8 inside" for one that starts again inside an attempt. Brief: "0+8".
TableText FormatStarts(std::int64_t multi_starts, std::int64_t inner_starts);

}  // namespace legopt::client

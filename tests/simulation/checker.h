#pragma once

#include <string>
#include <vector>

#include "tests/simulation/record.h"
#include "tests/simulation/simulated_worker.h"

namespace legopt::simulation {

/// Holds the history of what clients and workers did and were told against the final database, when all is at rest.
/// Returns every fault, its kind first:
///  - lost: acknowledged and not there;
///  - duplicated: there or acknowledged twice;
///  - unexpected: there, and nobody has sent it;
///  - wrong state: what is there contradicts itself or what was told.
/// Acceptance figures 1 - 4, 10, 26 (docs/reliability.md#the-figures).
std::vector<std::string> FaultsOf(const Record& record, const StoredState& state, const JobManners& manners);

}  // namespace legopt::simulation

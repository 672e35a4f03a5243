#pragma once

#include <string>
#include <vector>

#include "tests/simulation/record.h"
#include "tests/simulation/simulated_worker.h"

namespace legopt::simulation {

/// Compares the recorded actions and replies of clients and workers with the final database, when all processes are at
/// rest. Returns every fault, beginning with its kind:
/// - lost: acknowledged and missing;
/// - duplicated: present or acknowledged twice;
/// - unexpected: present although no process sent it;
/// - wrong state: inconsistent with itself or with a reply.
/// Acceptance figures 1 - 4, 10, 26 (docs/explanation/reliability.md#the-figures).
std::vector<std::string> FaultsOf(const Record& record, const StoredState& state, const JobBehaviour& manners);

}  // namespace legopt::simulation

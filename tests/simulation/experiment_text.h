#pragma once

#include <string>

namespace legopt::simulation {

/// The text of an experiment with `num_problems` jobs on dataset ddd...d, each third of them a motion when
/// `motions` is set. `wall_limit_s` bounds each attempt; `name` is part of the content. Jobs of equal problems are
/// equal: they take results of earlier experiments over unless `again` is set.
std::string ExperimentText(const std::string& name, int num_problems, double wall_limit_s, bool motions, bool again);

}  // namespace legopt::simulation

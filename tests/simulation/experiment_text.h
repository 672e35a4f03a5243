#pragma once

#include <string>

namespace legopt::simulation {

/// Name of the external solver of some methods, and the digits that stand in for its and such a method's hash.
inline constexpr char kExternalSolver[] = "mine";
inline constexpr char kSolverDigit = 'e', kExternalMethodDigit = 'b';

/// The text of an experiment with `num_problems` jobs on dataset ddd...d, each third of them a motion when
/// `motions` is set. `wall_limit_s` bounds each attempt; `name` is part of the content. Jobs of equal problems are
/// equal: they take results of earlier experiments over unless `again` is set. `external`: the method is that of the
/// external solver.
std::string ExperimentText(const std::string& name, int num_problems, double wall_limit_s, bool motions, bool again,
                           bool external = false);

}  // namespace legopt::simulation

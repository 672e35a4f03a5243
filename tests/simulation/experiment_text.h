#pragma once

#include <string>

namespace legopt::simulation {

/// Name of the external solver of some methods, and digits that represent the hashes of the solver and of such a
/// method.
inline constexpr char kExternalSolver[] = "mine";
inline constexpr char kSolverDigit = 'e', kExternalMethodDigit = 'b';

/// Returns the specification of an experiment with `num_problems` jobs on dataset ddd...d. If `motions` is set, every
/// third job is a motion. `wall_limit_s` bounds each attempt; `name` is part of the content. Jobs of the same problem
/// are identical and reuse results of earlier experiments unless `again` is set. `external`: the method is that of the
/// external solver.
std::string ExperimentText(const std::string& name, int num_problems, double wall_limit_s, bool motions, bool again,
                           bool external = false);

}  // namespace legopt::simulation

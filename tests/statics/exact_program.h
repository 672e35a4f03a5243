#pragma once

#include <optional>

#include "tests/statics/reference_program.h"

namespace legopt::test {

/// Returns the minimum of the program by QSopt_ex, in exact rational arithmetic on the program's doubles, rounded once;
/// empty if it is infeasible or unbounded.
std::optional<double> MinimumByExactSimplex(const ReferenceProgram& program);

}  // namespace legopt::test

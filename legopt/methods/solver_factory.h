#pragma once

#include <memory>

#include "legopt/methods/method.h"
#include "legopt/optimize/solver.h"

namespace legopt {

/// The solver of a method that Method::FromJson accepted, i.e. whose word the registry knows. Aborts when that word has
/// no maker (broken invariant; a test makes every one).
std::unique_ptr<Solver> MakeSolver(const Method& method);

}  // namespace legopt

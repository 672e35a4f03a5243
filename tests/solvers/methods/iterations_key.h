#pragma once

#include <string>

namespace legopt::test {

/// Returns the option that limits the inner loop of a registered solver: gradient and sampling methods count passes
/// over the terms.
inline std::string IterationsKey(const std::string& solver) {
  return solver == "sqp" || solver == "best" || solver == "ipopt" ? "max_iterations" : "max_epochs";
}

}  // namespace legopt::test

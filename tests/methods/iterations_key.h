#pragma once

#include <string>

namespace legopt::test {

/// The option that bounds the inner loop of a solver of the registry: gradients and samples count passes over the
/// terms.
inline std::string IterationsKey(const std::string& solver) {
  return solver == "sqp" || solver == "best" || solver == "ipopt" ? "max_iterations" : "max_epochs";
}

}  // namespace legopt::test

#pragma once

#include <cstddef>

#include "legopt/dataset/dataset.h"

namespace legopt {

/// Returns a motion of `stances` stances that walks back and forth over those of another one.
inline ProblemDefinition RepeatedMotion(const ProblemDefinition& once, std::size_t stances) {
  ProblemDefinition problem{once.id, {}};
  const std::size_t last = once.stances.size() - 1;
  for (std::size_t i = 0; i < stances; ++i) {
    const std::size_t place = i % (2 * last);
    problem.stances.push_back(once.stances[place <= last ? place : 2 * last - place]);
  }
  return problem;
}

}  // namespace legopt

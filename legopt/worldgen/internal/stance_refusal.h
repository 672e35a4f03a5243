#pragma once

#include <map>
#include <string>
#include <vector>

#include "legopt/worldgen/internal/stance_candidates.h"

namespace legopt::worldgen {

/// Data about a search for stances that found none, or not enough.
struct FailedSampling {
  int found = 0;                         ///< number of stances
  int wanted = 0;                        ///< number of stances
  SamplingStatistics tally;              ///< number of candidates by outcome
  std::map<std::string, int> obstacles;  ///< number of candidates by Candidate::obstacle of the most frequent outcome
  std::vector<Stance> infeasible;        ///< first stances without a posture
};

/// Throws the InputError of a failed search: its most frequent cause, the constraint or foot responsible, and a fix.
/// Examines `infeasible` with a few starts each (StanceCertifier::Explain), which takes seconds.
[[noreturn]] void RefuseStances(const ProbeModel& model, const FailedSampling& failed);

}  // namespace legopt::worldgen

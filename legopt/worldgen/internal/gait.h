#pragma once

#include <string>
#include <vector>

#include "legopt/worldgen/internal/reach_cloud.h"

namespace legopt::worldgen {

/// A cycle of phases; in each phase, some contacts move together while the others stand.
struct Gait {
  std::string name;                      ///< "walk", "trot" or "tripod"
  std::vector<std::vector<int>> phases;  ///< indices of the moving contacts, ascending; phases in order of the cycle
};

/// Returns the gaits of a robot by its number of contacts, the one that moves most contacts at once first: four have
/// trot and walk, six have tripod and walk, others walk.
///
/// Walk moves one contact at a time, on each side from hind to front. Trot and tripod move every second contact around
/// the robot: the diagonal pairs of four, the two tripods of six. Places are those of the nominal posture.
std::vector<Gait> GaitsOf(const ReachCloud& reach);

}  // namespace legopt::worldgen

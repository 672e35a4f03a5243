#pragma once

#include <string>
#include <vector>

#include "legopt/worldgen/internal/reach_cloud.h"

namespace legopt::worldgen {

/// A cycle of phases; in each phase, some contacts move together while the others stand.
struct Gait {
  std::string name;                      ///< "walk", "trot", "tripod" or "alternating"
  std::vector<std::vector<int>> phases;  ///< indices of the moving contacts, ascending; phases in order of the cycle
  bool any_order = false;                ///< any phase may follow any other one
};

/// Returns the gaits of a robot by its number of contacts, the one that moves most contacts at once first: four have
/// trot and walk, six have tripod and walk, five, seven and more have alternating and walk, three walk.
///
/// Walk moves one contact at a time, on each side from hind to front; in any order with another number of contacts than
/// four or six. The others move every second contact around the robot: the diagonal pairs of four, the two tripods of
/// six. The last one of an odd number moves alone. Places are those of the nominal posture.
std::vector<Gait> GaitsOf(const ReachCloud& reach);

}  // namespace legopt::worldgen

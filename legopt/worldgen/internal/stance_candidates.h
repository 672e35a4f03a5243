#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "legopt/worldgen/internal/stance_sampler.h"
#include "legopt/worldgen/internal/walkable_area.h"

namespace legopt::worldgen {

/// Outcome of a candidate: the first check that rejects it, or a stance.
enum class Fate : std::uint8_t {
  kFirstFoot,   ///< slope, support or collision of the first foot; for more than two feet, of any of them
  kSecondFoot,  ///< no second foot found; for more than two feet, no feet within reach of one trunk
  kTrunk,       ///< trunk box in collision
  kInfeasible,  ///< no posture found by SQP, or not accepted by the judge
  kStance       ///< accepted
};

/// Candidate for a stance.
struct Candidate {
  Fate fate = Fate::kFirstFoot;
  Stance stance;         ///< stance of kInfeasible and kStance
  std::string obstacle;  ///< kInfeasible: PostureProof::failure; kFirstFoot: name of the foot, if known
};

/// Generates and tests candidates; a workspace of one thread.
class StanceCandidates {
 public:
  virtual ~StanceCandidates() = default;
  /// Returns candidate `number`, which depends on this number and the seed only.
  virtual Candidate Try(std::int64_t number) = 0;
};

/// Returns candidates for robots with more than two feet. A candidate is a trunk at a random point, uniform by area, on
/// all surfaces that are flat enough, with a uniform yaw. Each foot gets a random sample of its reach cloud, projected
/// on a valid foothold within the step height of the trunk's point. Feet must be within the reach of each other, and
/// within reach of one trunk (ReachCloud::ReachesAll). `model`, `area` and `options` must outlive the result.
std::unique_ptr<StanceCandidates> MakeLeggedCandidates(const std::shared_ptr<const ProbeModel>& model,
                                                       const WalkableArea& area, const StanceSamplerOptions& options);

}  // namespace legopt::worldgen

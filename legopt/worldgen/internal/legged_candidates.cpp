#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "legopt/math/random_numbers.h"
#include "legopt/worldgen/internal/seeds.h"
#include "legopt/worldgen/internal/stance_candidates.h"

namespace legopt::worldgen {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kTrunkMargin_m = 1e-3;

/// Samples of a leg's reach at which it can stand: at a height below the trunk at which feet stand, and nearer to the
/// nominal place of its own foot than to that of any other one, so that legs do not cross.
std::vector<ReachSample> StandingSamples(const ReachCloud& reach, int contact) {
  constexpr double kLowest = 1.15;
  constexpr double kHighest = 0.6;
  constexpr double kTurn_rad = M_PI / 6.0;
  const auto distance = [&](int c, const ReachSample& sample) {
    return (reach.nominal(c).position - sample.position).head<2>().norm();
  };
  std::vector<ReachSample> standing;
  for (const ReachSample& sample : reach.samples(contact)) {
    const double below_m = -sample.position.z();
    if (below_m < kHighest * reach.height_m() || below_m > kLowest * reach.height_m()) continue;
    if (std::abs(std::remainder(sample.yaw_rad - reach.nominal(contact).yaw_rad, 2.0 * M_PI)) > kTurn_rad) continue;
    bool own = true;
    for (int c = 0; c < reach.num_contacts() && own; ++c) own = distance(contact, sample) <= distance(c, sample);
    if (own) standing.push_back(sample);
  }
  if (standing.empty()) standing.push_back(reach.nominal(contact));
  return standing;
}

class LeggedCandidates : public StanceCandidates {
 public:
  LeggedCandidates(const std::shared_ptr<const ProbeModel>& model, const WalkableArea& area,
                   const StanceSamplerOptions& options)
      : probe_(model), reach_(*model->reach), area_(area), options_(options) {
    if (options.prove) prover_.emplace(model->dataset);
    for (int c = 0; c < reach_.num_contacts(); ++c) samples_.push_back(StandingSamples(reach_, c));
  }

  Candidate Try(std::int64_t number) override {
    std::mt19937_64 generator(DeriveSeed(options_.seed, "legged stance/" + std::to_string(number)));
    const Vector3d point = area_.Sample(generator).first;
    const TrunkPose trunk{
        .position = point.head<2>(), .yaw_rad = M_PI * (2.0 * UniformRandom(generator) - 1.0), .ground_m = point.z()};
    Candidate candidate;
    if (!options_.region.isEmpty() && !options_.region.contains(trunk.position)) return candidate;
    for (int c = 0; c < reach_.num_contacts(); ++c) {
      std::optional<ContactTarget> foothold = FindFoothold(c, trunk, generator);
      if (!foothold) {
        candidate.obstacle = probe_.model().dataset->feet()[static_cast<size_t>(c)].name;
        return candidate;
      }
      candidate.stance.contacts.push_back(std::move(*foothold));
    }
    candidate.fate = Test(candidate.stance);
    if (candidate.fate != Fate::kStance || !prover_) return candidate;
    PostureProof proof = prover_->Prove(candidate.stance, 0);
    if (proof.accepted) return candidate;
    candidate.fate = Fate::kInfeasible;
    candidate.obstacle = std::move(proof.failure);
    return candidate;
  }

 private:
  std::optional<ContactTarget> FindFoothold(int contact, const TrunkPose& trunk, std::mt19937_64& generator) {
    const std::vector<ReachSample>& samples = samples_[static_cast<size_t>(contact)];
    for (int k = 0; k < options_.second_foot_tries; ++k) {
      const auto index = static_cast<size_t>(UniformRandom(generator) * static_cast<double>(samples.size()));
      const ReachSample& sample = samples[index];
      const Vector2d at = trunk.At(sample.position.head<2>());
      probe_.Footholds(contact, at.x(), at.y(), trunk.yaw_rad + sample.yaw_rad, footholds_);
      for (const ContactTarget& foothold : footholds_) {
        if (std::abs(foothold.position.z() - trunk.ground_m) <= probe_.model().options.step_m) return foothold;
      }
    }
    return {};
  }

  /// Tests the feet against each other and the trunk.
  Fate Test(const Stance& stance) {
    const ProbeOptions& options = probe_.model().options;
    const std::vector<ReachCloud::Placement> placements = PlacementsOf(*probe_.model().dataset, stance);
    for (const ReachCloud::Placement& a : placements) {
      for (const ReachCloud::Placement& b : placements) {
        const Vector3d apart = a.position - b.position;
        if (apart.head<2>().norm() > options.reach_m || std::abs(apart.z()) > options.step_m) return Fate::kSecondFoot;
      }
    }
    const TrunkPose trunk = probe_.TrunkOver(stance);
    if (!reach_.ReachesAll(placements, trunk)) return Fate::kSecondFoot;
    return probe_.TrunkDistance(trunk, kTrunkMargin_m) < kTrunkMargin_m ? Fate::kTrunk : Fate::kStance;
  }

  StanceProbe probe_;
  std::optional<PostureProver> prover_;
  const ReachCloud& reach_;
  const WalkableArea& area_;
  const StanceSamplerOptions& options_;
  std::vector<std::vector<ReachSample>> samples_;  ///< StandingSamples of each contact
  std::vector<ContactTarget> footholds_;
};

}  // namespace

std::unique_ptr<StanceCandidates> MakeLeggedCandidates(const std::shared_ptr<const ProbeModel>& model,
                                                       const WalkableArea& area, const StanceSamplerOptions& options) {
  return std::make_unique<LeggedCandidates>(model, area, options);
}

}  // namespace legopt::worldgen

#pragma once

#include <Eigen/Geometry>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "legopt/certify/leg_reach.h"
#include "legopt/dataset/dataset.h"
#include "legopt/dataset/stance.h"

namespace legopt::certify {

/// Proves that a stance has no posture where the legs alone decide: no pose of the base has all feet that stand within
/// their legs' reach (LegReach), the judge's tolerances of their poses included. What trunk, arms, balance and scene
/// have to say is not asked.
///
/// Branch and bound over position, yaw, pitch and roll of the base: a cell is discarded when one feature of one leg is
/// out of bounds at its centre by more than it can change within the cell. All cells discarded is a proof. A centre
/// that no leg objects to ends the search without one.
///
/// Sound, and incomplete. Immutable; any thread; the dataset must outlive it.
class ReachProver {
 public:
  /// Cells looked at, at most.
  static constexpr int kMostCells = 200'000;

  /// Measures what the legs can reach: about a second.
  explicit ReachProver(const Dataset& dataset);

  /// The proof as a sentence; nothing: not proven. Throws InputError for a link that is no foot.
  std::optional<std::string> Refute(const Stance& stance, int most_cells = kMostCells) const;
  /// Whether no leg objects to this pose of the base: what all bases of postures of the stance fulfil.
  bool Allows(const Stance& stance, const Eigen::Isometry3d& X_WB) const;

 private:
  struct Standing;
  struct Cell;

  std::vector<Standing> StandingLegs(const Stance& stance) const;

  const Dataset* dataset_;
  std::map<std::string, LegReach> legs_;  ///< by foot
};

}  // namespace legopt::certify

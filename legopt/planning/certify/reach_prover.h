#pragma once

#include <Eigen/Geometry>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/dataset/stance.h"
#include "legopt/planning/certify/leg_reach.h"

namespace legopt::certify {

/// Proves that a stance has no posture because of the legs alone: no pose of the base has all planted feet within their
/// legs' reach (LegReach), including the judge's tolerances of their poses. Trunk, arms, balance and scene are not
/// considered.
///
/// Branch and bound over position, yaw, pitch and roll of the base. A cell is discarded if one feature of one leg is
/// out of bounds at its centre by more than it can change within the cell. If all cells are discarded, that is a proof.
/// If a centre is within all bounds, the search ends without a proof.
///
/// Sound, but incomplete. Immutable; any thread; the dataset must outlive it.
class ReachProver {
 public:
  /// Maximum number of cells.
  static constexpr int kMaxCells = 200'000;

  /// Computes the reach of the legs: about a second.
  explicit ReachProver(const Dataset& dataset);

  /// Returns the proof as a sentence, or nothing if there is none. Throws InputError for a link that is not a foot.
  std::optional<std::string> Refute(const Stance& stance, int most_cells = kMaxCells) const;
  /// Returns whether this pose of the base is within the bounds of all legs, as it is for every posture of the stance.
  bool Allows(const Stance& stance, const Eigen::Isometry3d& X_WB) const;

 private:
  struct Standing;
  struct Cell;

  std::vector<Standing> StanceLegs(const Stance& stance) const;

  const Dataset* dataset_;
  std::map<std::string, LegReach> legs_;  ///< one entry per foot
};

}  // namespace legopt::certify

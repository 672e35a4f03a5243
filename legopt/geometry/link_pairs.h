#pragma once

#include <cstdint>
#include <vector>

#include "legopt/geometry/collision_model.h"
#include "legopt/geometry/link_pieces.h"
#include "legopt/geometry/link_trimeshes.h"

namespace legopt {

/// Level of detail for checking a link pair.
enum class PairResolution : std::uint8_t {
  kHulls,   ///< one hull per mesh
  kPieces,  ///< decomposed meshes, if hulls would overlap in valid postures
  kBodies   ///< meshes decomposed body by body, if links reach into each other's hollows
};

/// Link pairs to be checked, and their level of detail.
struct LinkPairRules {
  std::vector<CollisionModel::PairStatus> status;         ///< num_links x num_links, row by row, symmetric
  EnumArray<PairSelection, std::vector<LinkPair>> pairs;  ///< pairs of each selection, ascending by (second, first)
  PairSelection selection = PairSelection::kReference;    ///< selection used by the solver
  /// Level of detail, num_links x num_links like `status`, for the solver's pairs. kPieces: the hulls overlap in a
  /// considerable share of the postures in which the meshes do not, or the links touch in the reference posture.
  /// kBodies: pairs that touch in the reference posture and whose pieces also overlap in most postures in which the
  /// meshes do not.
  std::vector<PairResolution> detail;
  std::vector<LinkPair> decomposed;  ///< the solver's pairs with more detail than hulls, in its order

  const std::vector<LinkPair>& checked() const { return pairs[selection]; }  ///< pairs checked by the solver
};

/// Classifies all link pairs. `meshes`: the robot's exact meshes, whose poses are changed. `pieces`: those of the
/// robot. `reference_x`: see CollisionModel::Build. Deterministic: false overlaps are counted, and separable pairs are
/// detected, over a fixed sequence of postures, uniform within the joint limits.
LinkPairRules ClassifyLinkPairs(const RobotModel& robot, LinkTrimeshes& meshes, LinkPieces& pieces,
                                Eigen::Ref<const Eigen::VectorXd> reference_x, PairSelection selection);

}  // namespace legopt

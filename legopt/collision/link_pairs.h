#pragma once

#include <cstdint>
#include <vector>

#include "legopt/collision/collision_model.h"
#include "legopt/collision/link_pieces.h"
#include "legopt/collision/link_trimeshes.h"

namespace legopt {

/// By what two links are compared.
enum class PairDetail : std::uint8_t {
  kHulls,   ///< one hull per mesh
  kPieces,  ///< meshes cut into pieces: hulls would forbid what is free
  kBodies   ///< every body of the meshes cut by itself: the links reach into each other's hollows
};

/// Which pairs of links are compared, and which of them need more than one hull per mesh.
struct LinkPairRules {
  std::vector<CollisionModel::PairStatus> status;       ///< num_links x num_links, row by row, symmetric
  Per<PairSelection, std::vector<LinkPair>> pairs;      ///< by each selection; ascending by (second, first)
  PairSelection selection = PairSelection::kReference;  ///< which of them the solver compares
  /// num_links x num_links like `status`. Of the solver's pairs: by pieces those whose hulls overlap although the
  /// meshes are apart in a fair share of all postures, and those that touch in the reference pose; of the latter by
  /// bodies those whose pieces overlap, too, in most of the postures in which the meshes are apart.
  std::vector<PairDetail> detail;
  std::vector<LinkPair> decomposed;  ///< the solver's pairs of more detail than hulls, in its order

  const std::vector<LinkPair>& checked() const { return pairs[selection]; }  ///< what the solver compares
};

/// `meshes` holds the robot's exact meshes; it is left at some posture. `pieces` are of the robot. `reference_x` as in
/// CollisionModel::Build. Deterministic: phantom overlaps are counted, and what motion can part is looked for, over a
/// fixed sequence of postures, uniform within the joint limits.
LinkPairRules ClassifyLinkPairs(const RobotModel& robot, LinkTrimeshes& meshes, LinkPieces& pieces,
                                Eigen::Ref<const Eigen::VectorXd> reference_x, PairSelection selection);

}  // namespace legopt

#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

#include "legopt/geometry/collision_model.h"
#include "legopt/geometry/internal/convex_shape.h"
#include "legopt/geometry/internal/link_trimeshes.h"
#include "legopt/robot/robot_model.h"

namespace legopt {

/// @file
/// False overlaps: convex shapes of two links overlap in a posture in which the links' meshes are apart. They are
/// counted over fixed sequences of postures, uniform within the joint limits. Deterministic.

/// Rules by which meshes are apart and shapes overlap.
enum class ApartBy : std::uint8_t {
  kTouch,     ///< the meshes do not touch; the shapes overlap by more than 1 mm
  kTolerance  ///< the meshes overlap by no more than the judge tolerates, as the parts of a bearing do; the shapes are
              ///< less than 1 mm apart, since solvers keep a gap
};

/// Convex shapes of two links that are compared in place of their meshes, in link frames.
struct PairShapes {
  const std::vector<ConvexShape>& first;
  const std::vector<ConvexShape>& second;
};

/// Returns true if the meshes of two links touch in their present poses.
bool Touch(const LinkTrimeshes& meshes, const LinkPair& pair);

/// Returns true if the meshes of two links overlap by more than 1 mm in their present poses, by contacts or by vertices
/// inside closed bodies.
bool Overlap(const LinkTrimeshes& meshes, const LinkPair& pair);

/// Returns the pairs whose hulls overlap falsely in at least one in eight postures, in the order of `pairs`. 64
/// postures count (kTouch), or only those in which the meshes are apart (kTolerance). Changes the poses of `meshes`.
std::vector<LinkPair> FindFalselyOverlapping(const RobotModel& robot, LinkTrimeshes& meshes,
                                             const std::vector<LinkPair>& pairs, ApartBy apart);

/// Poses of two links in the world, in one posture.
struct PairPoses {
  Eigen::Isometry3d first, second;
};

/// Postures of two links, sorted by whether their meshes are apart.
struct SortedPoses {
  std::vector<PairPoses> apart, overlapping;
};

/// Returns the poses of each pair in 512 postures, of which the first is the neutral one. Few postures separate some
/// pairs, so many are sampled. Changes the poses of `meshes`.
std::vector<SortedPoses> SamplePoses(const RobotModel& robot, LinkTrimeshes& meshes, const std::vector<LinkPair>& pairs,
                                     ApartBy apart);

/// Returns true if the shapes overlap in most of the poses.
bool MostlyOverlap(std::span<const PairPoses> poses, const PairShapes& shapes, ApartBy apart);

/// The length by which two shapes must shrink to overlap where the meshes of their links overlap, and only there.
struct FalseDepth {
  double length_m = 0.0;  ///< >= 0
  double score = 0.0;  ///< Youden's index: share of the postures in `apart` in which the shrunk shapes are apart, minus
                       ///< the share of those in `overlapping`; in [0, 1]
};

/// Returns the best length. Candidates are the depths of the shapes in `apart`; the larger one of equal scores is
/// better. So shapes that tell nothing, with score 0, may shrink until they are apart in all of `apart`. Without
/// postures in `apart`: length 0.
FalseDepth FindFalseDepth(const SortedPoses& poses, const PairShapes& shapes, ApartBy apart);

}  // namespace legopt

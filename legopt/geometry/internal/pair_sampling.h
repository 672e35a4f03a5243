#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "legopt/geometry/collision_model.h"
#include "legopt/robot/robot_model.h"

namespace legopt {

/// Sampling of self-collision.
struct PairSamplingOptions {
  int samples = 10'000;    ///< number of postures, >= 1
  std::uint64_t seed = 1;  ///< seed of the postures
};

/// Classification of all pairs of links with geometry.
struct SampledPairs {
  std::vector<UncheckedPair> unchecked;  ///< ascending by (second, first)
  std::vector<LinkPair> checked;         ///< all other pairs, in the same order
  std::vector<LinkPair> nominal_only;    ///< pairs of `checked` that collide in the nominal posture but in no sample
};

/// Classifies pairs of links by sampled postures, as MoveIt's setup assistant does.
///
/// Joints are uniform within their limits; rotations without limits, or with limits wider than a full turn, within
/// [-pi, pi]. Collision is an overlap of more than 1 mm, the judge's tolerance. A pair is
/// * adjacent if at most one moving joint lies between its links, whether or not there are links without geometry;
/// * never in collision if the convex hulls of its geometries are apart in all samples and in the nominal posture.
/// Hulls
///   contain the meshes, so that no collision in a sample is overlooked;
/// * always in collision if the hulls overlap in more than 95 % of all samples, and the exact meshes in more than 95 %
///   of the first 128;
/// * else checked, also if it collides in `nominal_x` only.
///
/// Depends on nothing but its arguments. Loads the robot's meshes and throws InputError if one cannot be loaded.
SampledPairs SampleLinkPairs(const RobotModel& robot, Eigen::Ref<const Eigen::VectorXd> nominal_x,
                             const PairSamplingOptions& options);

/// A pair of links and the depth of their overlap.
struct PairDepth {
  LinkPair pair;  ///< first < second
  UncheckedReason reason = UncheckedReason::kAdjacent;
  double depth_m = 0.0;  ///< > 0: contact depth or depth of a vertex inside the other body, whichever is larger
};

/// Returns up to `count` pairs of `unchecked` that overlap most at the configuration `x`, the deepest first. Throws
/// InputError.
std::vector<PairDepth> DeepestPairs(const RobotModel& robot, const std::vector<UncheckedPair>& unchecked,
                                    Eigen::Ref<const Eigen::VectorXd> x, int count);

}  // namespace legopt

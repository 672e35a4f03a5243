#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "legopt/generate/stance_probe.h"

namespace legopt::generate {

/// What the paper describes problems by.
struct StanceFeatures {
  double length_m = 0.0;          ///< horizontal distance of the feet
  double height_m = 0.0;          ///< absolute difference of their heights
  double tilt_rad = 0.0;          ///< of the steeper foothold
  double trunk_distance_m = 0.0;  ///< signed distance of the trunk box from the scene, at most kTrunkRange_m

  /// Farther than this the trunk is free.
  static constexpr double kTrunkRange_m = 1.0;
};

/// Of a stance on one or two feet; a single foot has length and height 0.
StanceFeatures FeaturesOf(const Stance& stance, StanceProbe& probe);

/// K-means (Lloyd) with k-means++ starts over points scaled by the standard deviation of each coordinate.
///
/// Returns for each of `k` clusters the indices of all its points, nearest to the centre first; clusters in the order
/// of their first point, none empty; fewer than `k` when fewer points differ. Deterministic: draws from `seed` only.
/// Needs 1 <= k <= points (InputError).
std::vector<std::vector<int>> ClusterPoints(std::span<const Eigen::Vector3d> points, int k, std::uint64_t seed);

}  // namespace legopt::generate

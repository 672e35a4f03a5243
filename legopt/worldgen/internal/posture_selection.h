#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "legopt/worldgen/internal/stance_probe.h"

namespace legopt::worldgen {

/// Features that the paper uses to describe problems.
struct StanceFeatures {
  double length_m = 0.0;          ///< horizontal distance of the feet
  double height_m = 0.0;          ///< absolute difference of their heights
  double tilt_rad = 0.0;          ///< tilt of the steeper contact
  double trunk_distance_m = 0.0;  ///< signed distance of the trunk box from the scene, at most kTrunkRange_m

  /// Upper limit of trunk_distance_m.
  static constexpr double kTrunkRange_m = 1.0;
};

/// Computes the features of a stance on one or two feet; for a single foot, length and height are 0.
StanceFeatures FeaturesOf(const Stance& stance, StanceProbe& probe);

/// Clusters points by K-means (Lloyd) with k-means++ initialization, after scaling each coordinate by its standard
/// deviation.
///
/// Returns for each of `k` clusters the indices of all its points, nearest to the centre first; clusters in the order
/// of their first point, none empty; fewer than `k` if fewer points differ. Deterministic: random numbers come from
/// `seed` only. Throws InputError unless 1 <= k <= number of points.
std::vector<std::vector<int>> ClusterPoints(std::span<const Eigen::Vector3d> points, int k, std::uint64_t seed);
using Vector6d = Eigen::Matrix<double, 6, 1>;
/// Clusters points of six coordinates likewise.
std::vector<std::vector<int>> ClusterPoints(std::span<const Vector6d> points, int k, std::uint64_t seed);

/// Predicate: does point `point` have a posture? Called by thread `worker` < threads, concurrently for different
/// clusters, and never again for a cluster after it returned true.
using ProveMember = std::function<bool(int worker, std::size_t cluster, int point)>;

/// Chooses `count` points: K-means (ClusterPoints), then from each cluster the point nearest to its centre that has a
/// posture. If a cluster has none, its points are removed and the remaining ones are clustered and checked again.
///
/// Returns one index into `points` per cluster. Deterministic if `prove` is, independent of the number of threads.
/// `progress` (chosen, of count) is called after each clustering; may be empty. Throws InputError if there are too few
/// points with a posture, or too few different points, for `count` clusters.
std::vector<int> SelectProven(std::span<const Eigen::Vector3d> points, int count, std::uint64_t seed, int threads,
                              const ProveMember& prove, const std::function<void(int, int)>& progress);

}  // namespace legopt::worldgen

#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace legopt::worldgen {

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

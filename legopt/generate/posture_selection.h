#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace legopt::generate {

/// Whether point `point` has a posture, asked on behalf of cluster `cluster`; called by thread `worker` < threads, for
/// different clusters at the same time, never again for a cluster after it was true.
using ProveMember = std::function<bool(int worker, std::size_t cluster, int point)>;

/// Chooses `count` of the points: K-means (ClusterPoints), and of each cluster the point nearest to its centre that has
/// a posture. Points of a cluster without any are no candidates: the others are clustered again, and asked again.
///
/// Returns one index into `points` per cluster. Deterministic if `prove` is, whatever the number of threads. `progress`
/// (chosen, of count) is called after each clustering; may be empty. Throws InputError when the points run out: those
/// with a posture in their neighbourhood, or places that differ, are fewer than `count`.
std::vector<int> SelectProven(std::span<const Eigen::Vector3d> points, int count, std::uint64_t seed, int threads,
                              const ProveMember& prove, const std::function<void(int, int)>& progress);

}  // namespace legopt::generate

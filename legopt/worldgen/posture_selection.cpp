#include "legopt/worldgen/posture_selection.h"

#include <algorithm>
#include <string>

#include "legopt/math/parallel.h"
#include "legopt/types/input_error.h"
#include "legopt/worldgen/stance_features.h"

namespace legopt::worldgen {
namespace {

constexpr int kNone = -1;

/// Returns for each cluster the first member that `prove` accepts, or kNone.
std::vector<int> ProveClusters(const std::vector<std::vector<int>>& clusters, int threads, const ProveMember& prove) {
  std::vector<int> chosen(clusters.size(), kNone);
  ForEachIndex(threads, clusters.size(), [&](int worker, std::size_t c) {
    const auto proven =
        std::find_if(clusters[c].begin(), clusters[c].end(), [&](int member) { return prove(worker, c, member); });
    if (proven != clusters[c].end()) chosen[c] = *proven;
  });
  return chosen;
}

}  // namespace

std::vector<int> SelectProven(std::span<const Eigen::Vector3d> points, int count, std::uint64_t seed, int threads,
                              const ProveMember& prove, const std::function<void(int, int)>& progress) {
  std::vector<int> candidates(points.size());  // indices into `points`
  for (std::size_t i = 0; i < points.size(); ++i) candidates[i] = static_cast<int>(i);
  while (std::ssize(candidates) >= count) {
    std::vector<Eigen::Vector3d> places;
    for (const int candidate : candidates) places.push_back(points[static_cast<std::size_t>(candidate)]);
    std::vector<std::vector<int>> clusters = ClusterPoints(places, count, seed);
    if (std::ssize(clusters) < count) break;  // too few different points
    for (std::vector<int>& cluster : clusters) {
      for (int& member : cluster) member = candidates[static_cast<std::size_t>(member)];
    }
    const std::vector<int> chosen = ProveClusters(clusters, threads, prove);
    const auto proven = count - static_cast<int>(std::count(chosen.begin(), chosen.end(), kNone));
    if (progress) progress(proven, count);
    if (proven == count) return chosen;
    for (std::size_t c = 0; c < clusters.size(); ++c) {
      if (chosen[c] != kNone) continue;
      std::erase_if(candidates, [&](int candidate) {
        return std::find(clusters[c].begin(), clusters[c].end(), candidate) != clusters[c].end();
      });
    }
  }
  throw InputError({"selection", "posture problems", std::to_string(candidates.size()),
                    "the plans have only so many different stances whose neighbourhood has postures",
                    "ask for fewer posture problems, or for more plans"});
}

}  // namespace legopt::worldgen

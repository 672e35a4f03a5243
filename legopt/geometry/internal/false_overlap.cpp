#include "legopt/geometry/internal/false_overlap.h"

#include <algorithm>
#include <random>
#include <set>

#include "legopt/geometry/internal/model_data.h"
#include "legopt/geometry/internal/placed_shapes.h"
#include "legopt/robot/kinematics.h"

namespace legopt {
namespace {

constexpr double kTolerance_m = 1e-3;  // the judge's
constexpr std::uint64_t kPostureSeed = 1;

/// Returns true if the predicate holds for any pair of geometries of two links.
template <class Predicate>
bool AnyGeometries(const LinkTrimeshes& meshes, const LinkPair& pair, Predicate predicate) {
  for (int i = 0; i < meshes.num_geometries(pair.first); ++i) {
    for (int j = 0; j < meshes.num_geometries(pair.second); ++j) {
      if (predicate(meshes.geometry(pair.first, i), meshes.geometry(pair.second, j))) return true;
    }
  }
  return false;
}

/// Returns the depth from which shapes count as overlapping, m; negative: a gap. Solvers keep a gap of half a
/// millimetre.
double FirstDepth_m(ApartBy apart) { return apart == ApartBy::kTouch ? kTolerance_m : -kTolerance_m; }

bool HullsOverlap(const LinkTrimeshes& meshes, const LinkPair& pair, double depth_m) {
  return AnyGeometries(meshes, pair, [&](const auto& a, const auto& b) { return meshes.HullsOverlap(a, b, depth_m); });
}

/// Counts for one pair of links.
struct HullCount {
  int apart = 0;        ///< number of postures in which the meshes are apart
  int overlapping = 0;  ///< number of them in which the hulls overlap
};

/// Returns how much the shapes have to shrink to be apart in each of the poses, m, ascending.
std::vector<double> DepthsOf(std::span<const PairPoses> poses, const PairShapes& shapes, double first_depth_m) {
  PlacedShapes first(shapes.first), second(shapes.second);
  std::vector<double> depths;
  for (const PairPoses& pose : poses) {
    first.Place(pose.first);
    second.Place(pose.second);
    depths.push_back(first.Depth(second, first_depth_m) - first_depth_m);
  }
  std::ranges::sort(depths);
  return depths;
}

}  // namespace

bool Touch(const LinkTrimeshes& meshes, const LinkPair& pair) {
  return AnyGeometries(meshes, pair, [&](const auto& a, const auto& b) { return meshes.Depth(a, b) >= 0.0; });
}

bool Overlap(const LinkTrimeshes& meshes, const LinkPair& pair) {
  return AnyGeometries(meshes, pair, [&](const auto& a, const auto& b) { return meshes.Overlap(a, b, kTolerance_m); });
}

std::vector<LinkPair> FindFalselyOverlapping(const RobotModel& robot, LinkTrimeshes& meshes,
                                             const std::vector<LinkPair>& pairs, ApartBy apart) {
  constexpr int kPostures = 64;
  constexpr int kShare = 8;  // one in so many
  std::mt19937_64 random(kPostureSeed);
  Kinematics kinematics(robot);
  std::vector<HullCount> counts(pairs.size());
  for (int posture = 0; posture < kPostures; ++posture) {
    kinematics.UpdatePoses(SamplePosture(robot, random));
    meshes.Place(kinematics);
    for (size_t i = 0; i < pairs.size(); ++i) {
      HullCount& count = counts[i];
      if (kShare * count.overlapping >= kPostures) continue;  // decided
      if (!HullsOverlap(meshes, pairs[i], FirstDepth_m(apart))) {
        ++count.apart;
      } else if (apart == ApartBy::kTouch ? !Touch(meshes, pairs[i]) : !Overlap(meshes, pairs[i])) {
        ++count.apart;
        ++count.overlapping;
      }
    }
  }
  std::vector<LinkPair> found;
  for (size_t i = 0; i < pairs.size(); ++i) {
    const int of = apart == ApartBy::kTouch ? kPostures : counts[i].apart;
    if (counts[i].overlapping > 0 && kShare * counts[i].overlapping >= of) found.push_back(pairs[i]);
  }
  return found;
}

std::vector<SortedPoses> SamplePoses(const RobotModel& robot, LinkTrimeshes& meshes, const std::vector<LinkPair>& pairs,
                                     ApartBy apart) {
  constexpr int kPostures = 512;
  std::set<int> links;
  for (const auto& [a, b] : pairs) links.insert({a, b});
  std::mt19937_64 random(kPostureSeed);
  Kinematics kinematics(robot);
  std::vector<SortedPoses> poses(pairs.size());
  for (int posture = 0; posture < kPostures && !pairs.empty(); ++posture) {
    kinematics.UpdatePoses(posture == 0 ? robot.NeutralConfiguration() : SamplePosture(robot, random));
    for (const int link : links) meshes.Place(kinematics, link);
    for (size_t i = 0; i < pairs.size(); ++i) {
      const LinkPair& pair = pairs[i];
      const bool overlapping = (apart == ApartBy::kTouch && Touch(meshes, pair)) || Overlap(meshes, pair);
      (overlapping ? poses[i].overlapping : poses[i].apart)
          .push_back({kinematics.link_pose(pair.first), kinematics.link_pose(pair.second)});
    }
  }
  return poses;
}

bool MostlyOverlap(std::span<const PairPoses> poses, const PairShapes& shapes, ApartBy apart) {
  PlacedShapes first(shapes.first), second(shapes.second);
  const auto half = static_cast<std::ptrdiff_t>(poses.size() / 2);
  std::ptrdiff_t overlapping = 0;
  for (const PairPoses& pose : poses) {
    first.Place(pose.first);
    second.Place(pose.second);
    overlapping += first.Overlap(second, FirstDepth_m(apart)) ? 1 : 0;
    if (overlapping > half) return true;
  }
  return false;
}

FalseDepth FindFalseDepth(const SortedPoses& poses, const PairShapes& shapes, ApartBy apart) {
  const std::vector<double> apart_m = DepthsOf(poses.apart, shapes, FirstDepth_m(apart));
  const std::vector<double> overlapping_m = DepthsOf(poses.overlapping, shapes, FirstDepth_m(apart));
  const auto share = [](const std::vector<double>& sorted, double length_m) {
    const auto count = std::ranges::upper_bound(sorted, length_m) - sorted.begin();
    return sorted.empty() ? 0.0 : static_cast<double>(count) / static_cast<double>(sorted.size());
  };
  FalseDepth best;
  for (const double length_m : apart_m) {
    const double score = share(apart_m, length_m) - share(overlapping_m, length_m);
    if (score >= best.score) best = {length_m, score};
  }
  return best;
}

}  // namespace legopt

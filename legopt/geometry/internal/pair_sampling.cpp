#include "legopt/geometry/internal/pair_sampling.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <utility>

#include "legopt/geometry/internal/false_overlap.h"
#include "legopt/geometry/internal/link_trimeshes.h"
#include "legopt/geometry/internal/model_data.h"
#include "legopt/geometry/internal/placed_shapes.h"
#include "legopt/robot/kinematics.h"

namespace legopt {
namespace {

constexpr double kCollision_m = 1e-3;  // the judge's tolerance
constexpr double kAlways = 0.95;
constexpr int kExactSamples = 128;

/// Range of a degree of freedom for sampling.
struct Range {
  double lower, upper;
};

bool HasFollowers(const RobotModel& robot, int dof) {
  return std::ranges::any_of(robot.joints(), [&](const Joint& joint) { return joint.leader >= 0 && joint.dof == dof; });
}

Range RangeOf(const RobotModel& robot, int dof) {
  constexpr double kHalfTurn = std::numbers::pi;
  Range range{robot.lower_limits()[dof], robot.upper_limits()[dof]};
  const bool rotates = robot.joints()[static_cast<size_t>(robot.dof_joint(dof))].type != JointType::kPrismatic;
  const double width = range.upper - range.lower;
  // A follower may turn less than its leader, so that a full turn of the leader does not cover its range.
  if (rotates && width > 2.0 * kHalfTurn && (!std::isfinite(width) || !HasFollowers(robot, dof))) {
    return {-kHalfTurn, kHalfTurn};
  }
  if (!std::isfinite(range.lower)) range.lower = std::min(-kHalfTurn, range.upper - kHalfTurn);
  if (!std::isfinite(range.upper)) range.upper = std::max(kHalfTurn, range.lower + kHalfTurn);
  return range;
}

/// Sequence of postures, uniform within the ranges of the joints.
class Postures {
 public:
  Postures(const RobotModel& robot, std::uint64_t seed) : random_(seed), x_(robot.NeutralConfiguration()) {
    for (int dof = 0; dof < robot.num_dofs(); ++dof) ranges_.push_back(RangeOf(robot, dof));
  }

  const Eigen::VectorXd& Next() {
    constexpr int kMantissa = 53;
    for (size_t i = 0; i < ranges_.size(); ++i) {
      const double unit = std::ldexp(static_cast<double>(random_() >> (64 - kMantissa)), -kMantissa);
      x_[static_cast<Eigen::Index>(i)] = ranges_[i].lower + unit * (ranges_[i].upper - ranges_[i].lower);
    }
    return x_;
  }

 private:
  std::mt19937_64 random_;
  std::vector<Range> ranges_;
  Eigen::VectorXd x_;
};

/// Hulls of all links.
class LinkHulls {
 public:
  explicit LinkHulls(const RobotModel& robot) : kinematics_(robot) {
    for (const Link& link : robot.links()) links_.emplace_back(HullsOf(link, robot.read_guard()));
  }

  void Place(const Eigen::VectorXd& x) {
    kinematics_.UpdatePoses(x);
    for (size_t link = 0; link < links_.size(); ++link) {
      links_[link].Place(kinematics_.link_pose(static_cast<int>(link)));
    }
  }

  bool Overlap(const LinkPair& pair) const {
    return links_[static_cast<size_t>(pair.first)].Overlap(links_[static_cast<size_t>(pair.second)], kCollision_m);
  }

 private:
  Kinematics kinematics_;
  std::vector<PlacedShapes> links_;
};

/// A pair during sampling.
struct Candidate {
  LinkPair pair;
  bool nominal = false;  ///< hulls overlap in the nominal posture
  int overlaps = 0;      ///< number of samples with overlapping hulls

  /// Returns true if further samples cannot make it one that is always or never in collision.
  bool IsDecided(int done, int samples) const {
    return overlaps > 0 && static_cast<double>(done - overlaps) >= (1.0 - kAlways) * samples;
  }
};

void CountOverlaps(const RobotModel& robot, Eigen::Ref<const Eigen::VectorXd> nominal_x,
                   const PairSamplingOptions& options, std::vector<Candidate>* candidates) {
  LinkHulls hulls(robot);
  hulls.Place(nominal_x);
  for (Candidate& candidate : *candidates) candidate.nominal = hulls.Overlap(candidate.pair);
  std::vector<Candidate*> open;
  for (Candidate& candidate : *candidates) open.push_back(&candidate);
  Postures postures(robot, options.seed);
  for (int done = 1; done <= options.samples; ++done) {
    hulls.Place(postures.Next());
    for (Candidate* candidate : open) candidate->overlaps += hulls.Overlap(candidate->pair) ? 1 : 0;
    std::erase_if(open, [&](const Candidate* candidate) { return candidate->IsDecided(done, options.samples); });
  }
}

/// Returns those pairs whose meshes overlap in more than 95 % of the first samples.
std::vector<LinkPair> AlwaysOverlapping(const RobotModel& robot, const PairSamplingOptions& options,
                                        const std::vector<LinkPair>& pairs) {
  if (pairs.empty()) return {};
  const int samples = std::min(options.samples, kExactSamples);
  TrimeshWorld world;
  LinkTrimeshes meshes(robot, world);
  Kinematics kinematics(robot);
  Postures postures(robot, options.seed);
  std::vector<std::pair<LinkPair, int>> apart;  // with the number of samples without overlap
  for (const LinkPair& pair : pairs) apart.emplace_back(pair, 0);
  for (int i = 0; i < samples && !apart.empty(); ++i) {
    kinematics.UpdatePoses(postures.Next());
    meshes.Place(kinematics);
    for (auto& [pair, count] : apart) count += Overlap(meshes, pair) ? 0 : 1;
    std::erase_if(apart, [&](const auto& entry) { return entry.second >= (1.0 - kAlways) * samples; });
  }
  std::vector<LinkPair> always;
  for (const auto& [pair, count] : apart) always.push_back(pair);
  return always;
}

}  // namespace

SampledPairs SampleLinkPairs(const RobotModel& robot, Eigen::Ref<const Eigen::VectorXd> nominal_x,
                             const PairSamplingOptions& options) {
  const std::vector<LinkPair> all = ShapedPairs(robot);
  std::vector<Candidate> candidates;
  for (const LinkPair& pair : all) {
    if (robot.MovingJointsBetween(pair.first, pair.second) > 1) candidates.push_back({.pair = pair});
  }
  CountOverlaps(robot, nominal_x, options, &candidates);
  std::vector<LinkPair> mostly;
  for (const Candidate& candidate : candidates) {
    if (candidate.overlaps > kAlways * options.samples) mostly.push_back(candidate.pair);
  }
  const std::vector<LinkPair> always = AlwaysOverlapping(robot, options, mostly);
  SampledPairs result;
  auto candidate = candidates.begin();
  for (const LinkPair& pair : all) {
    if (candidate == candidates.end() || candidate->pair != pair) {
      result.unchecked.push_back({pair, UncheckedReason::kAdjacent});
      continue;
    }
    if (std::ranges::find(always, pair) != always.end()) {
      result.unchecked.push_back({pair, UncheckedReason::kAlways});
    } else if (candidate->overlaps == 0 && !candidate->nominal) {
      result.unchecked.push_back({pair, UncheckedReason::kNever});
    } else {
      result.checked.push_back(pair);
      if (candidate->overlaps == 0) result.nominal_only.push_back(pair);
    }
    ++candidate;
  }
  return result;
}

std::vector<PairDepth> DeepestPairs(const RobotModel& robot, const std::vector<UncheckedPair>& unchecked,
                                    Eigen::Ref<const Eigen::VectorXd> x, int count) {
  TrimeshWorld world;
  LinkTrimeshes meshes(robot, world);
  Kinematics kinematics(robot);
  kinematics.UpdatePoses(x);
  meshes.Place(kinematics);
  std::vector<PairDepth> depths;
  for (const UncheckedPair& entry : unchecked) {
    PairDepth found{.pair = entry.pair, .reason = entry.reason};
    for (int i = 0; i < meshes.num_geometries(entry.pair.first); ++i) {
      for (int j = 0; j < meshes.num_geometries(entry.pair.second); ++j) {
        const auto& a = meshes.geometry(entry.pair.first, i);
        const auto& b = meshes.geometry(entry.pair.second, j);
        found.depth_m = std::max({found.depth_m, meshes.ExactDepth(a, b), meshes.InsideDepth(a, b)});
      }
    }
    if (found.depth_m > 0.0) depths.push_back(found);
  }
  std::ranges::stable_sort(depths, std::greater<>(), &PairDepth::depth_m);
  depths.resize(std::min(depths.size(), static_cast<size_t>(count)));
  return depths;
}

}  // namespace legopt

#include "legopt/collision/link_pairs.h"

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

#include "legopt/robot/kinematics.h"

namespace legopt {
namespace {

using PairStatus = CollisionModel::PairStatus;

/// True when the predicate holds for some pair of geometries of two links.
template <class Predicate>
bool AnyGeometries(const LinkTrimeshes& meshes, const LinkPair& pair, Predicate predicate) {
  for (int i = 0; i < meshes.num_geometries(pair.first); ++i) {
    for (int j = 0; j < meshes.num_geometries(pair.second); ++j) {
      if (predicate(meshes.geometry(pair.first, i), meshes.geometry(pair.second, j))) return true;
    }
  }
  return false;
}

bool Touch(const LinkTrimeshes& meshes, const LinkPair& pair) {
  return AnyGeometries(meshes, pair, [&](const auto& a, const auto& b) { return meshes.Depth(a, b) >= 0.0; });
}

/// Hulls overlap noticeably, meshes do not meet.
bool IsPhantom(const LinkTrimeshes& meshes, const LinkPair& pair) {
  constexpr double kNoticeable = 1e-3;  // m
  const bool overlap =
      AnyGeometries(meshes, pair, [&](const auto& a, const auto& b) { return meshes.HullsOverlap(a, b, kNoticeable); });
  return overlap && !Touch(meshes, pair);
}

/// Joints uniform within their limits, base at the origin.
Eigen::VectorXd SamplePosture(const RobotModel& robot, std::mt19937_64& random) {
  Eigen::VectorXd x = Eigen::VectorXd::Zero(robot.configuration_size());
  x[robot.num_dofs() + 3] = 1.0;
  for (int i = 0; i < robot.num_dofs(); ++i) {
    constexpr int kMantissa = 53;
    const double unit = std::ldexp(static_cast<double>(random() >> (64 - kMantissa)), -kMantissa);
    const double lower = std::isfinite(robot.lower_limits()[i]) ? robot.lower_limits()[i] : -std::numbers::pi;
    const double upper = std::isfinite(robot.upper_limits()[i]) ? robot.upper_limits()[i] : std::numbers::pi;
    x[i] = lower + unit * (upper - lower);
  }
  return x;
}

std::vector<LinkPair> FindPhantomPairs(const RobotModel& robot, LinkTrimeshes& meshes,
                                       const std::vector<LinkPair>& checked) {
  constexpr int kPostures = 64;
  constexpr int kFairShare = 8;
  constexpr std::uint64_t kSeed = 1;
  std::mt19937_64 random(kSeed);
  Kinematics kinematics(robot);
  std::vector<int> count(checked.size(), 0);
  for (int posture = 0; posture < kPostures; ++posture) {
    kinematics.Update(SamplePosture(robot, random));
    meshes.Place(kinematics);
    for (size_t i = 0; i < checked.size(); ++i) {
      if (count[i] < kFairShare && IsPhantom(meshes, checked[i])) ++count[i];
    }
  }
  std::vector<LinkPair> phantom;
  for (size_t i = 0; i < checked.size(); ++i) {
    if (count[i] >= kFairShare) phantom.push_back(checked[i]);
  }
  return phantom;
}

}  // namespace

LinkPairRules ClassifyLinkPairs(const RobotModel& robot, LinkTrimeshes& meshes,
                                Eigen::Ref<const Eigen::VectorXd> reference_x) {
  Kinematics kinematics(robot);
  kinematics.Update(reference_x);
  meshes.Place(kinematics);
  const int n = static_cast<int>(robot.links().size());
  LinkPairRules rules;
  rules.status.assign(static_cast<size_t>(n) * static_cast<size_t>(n), PairStatus::kIgnoredAdjacent);
  for (int b = 0; b < n; ++b) {
    for (int a = 0; a < b; ++a) {
      const bool bare = meshes.num_geometries(a) == 0 || meshes.num_geometries(b) == 0;
      if (bare || robot.MovingJointsBetween(a, b) <= 1) continue;
      const bool touch = Touch(meshes, {a, b});
      const PairStatus status = touch ? PairStatus::kIgnoredReferencePose : PairStatus::kChecked;
      rules.status[static_cast<size_t>(a * n + b)] = status;
      rules.status[static_cast<size_t>(b * n + a)] = status;
      if (!touch) rules.checked.emplace_back(a, b);
    }
  }
  rules.phantom = FindPhantomPairs(robot, meshes, rules.checked);
  return rules;
}

}  // namespace legopt

#include "legopt/geometry/internal/model_data.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <iterator>
#include <map>
#include <numbers>
#include <random>
#include <set>
#include <utility>

#include "legopt/geometry/internal/false_overlap.h"
#include "legopt/robot/kinematics.h"

namespace legopt {
namespace {

using PairStatus = CollisionModel::PairStatus;

constexpr std::uint64_t kSeed = 1;

}  // namespace

Eigen::VectorXd SamplePosture(const RobotModel& robot, std::mt19937_64& random) {
  Eigen::VectorXd x = robot.NeutralConfiguration();
  for (int i = 0; i < robot.num_dofs(); ++i) {
    constexpr int kMantissa = 53;
    const double unit = std::ldexp(static_cast<double>(random() >> (64 - kMantissa)), -kMantissa);
    const double lower = std::isfinite(robot.lower_limits()[i]) ? robot.lower_limits()[i] : -std::numbers::pi;
    const double upper = std::isfinite(robot.upper_limits()[i]) ? robot.upper_limits()[i] : std::numbers::pi;
    x[i] = lower + unit * (upper - lower);
  }
  return x;
}

namespace {

/// Returns all pairs of links with geometry and more than one moving joint between them, ascending by (second, first).
std::vector<LinkPair> NonAdjacentPairs(const RobotModel& robot, const LinkTrimeshes& meshes) {
  std::vector<LinkPair> pairs;
  for (int b = 0; b < static_cast<int>(robot.links().size()); ++b) {
    for (int a = 0; a < b; ++a) {
      const bool bare = meshes.num_geometries(a) == 0 || meshes.num_geometries(b) == 0;
      if (!bare && robot.MovingJointsBetween(a, b) > 1) pairs.emplace_back(a, b);
    }
  }
  return pairs;
}

/// Sets the status of a pair of a robot's links, in both orders, in a table of LinkPairRules::status.
void SetStatus(const RobotModel& robot, const LinkPair& pair, PairStatus value, std::vector<PairStatus>* status) {
  const auto [first, second] = std::pair(static_cast<size_t>(pair.first), static_cast<size_t>(pair.second));
  const size_t n = robot.links().size();
  (*status)[first * n + second] = (*status)[second * n + first] = value;
}

/// Returns a table of LinkPairRules::status in which no pair is checked.
std::vector<PairStatus> NoneChecked(const RobotModel& robot) {
  return std::vector<PairStatus>(robot.links().size() * robot.links().size(), PairStatus::kIgnoredAdjacent);
}

/// Returns the table of LinkPairRules::status: `pairs` that are not in `checked` have the status `ignored`, all others
/// are adjacent.
std::vector<PairStatus> StatusOf(const RobotModel& robot, const std::vector<LinkPair>& pairs, PairStatus ignored,
                                 const std::vector<LinkPair>& checked) {
  std::vector<PairStatus> status = NoneChecked(robot);
  for (const LinkPair& pair : pairs) SetStatus(robot, pair, ignored, &status);
  for (const LinkPair& pair : checked) SetStatus(robot, pair, PairStatus::kChecked, &status);
  return status;
}

PairStatus StatusOfListed(UncheckedReason reason, PairSelection selection) {
  switch (reason) {
    case UncheckedReason::kAdjacent:
      return PairStatus::kIgnoredAdjacent;
    case UncheckedReason::kNever:
      return selection == PairSelection::kAll ? PairStatus::kChecked : PairStatus::kIgnoredNever;
    case UncheckedReason::kAlways:
    case UncheckedReason::kStanding:
    case UncheckedReason::kUser:
      break;
  }
  return PairStatus::kIgnoredAlways;
}

/// Returns the pairs that overlap in every posture of the sequence, as if they were one body, although more than one
/// joint lies between them.
std::vector<LinkPair> FindInseparablePairs(const RobotModel& robot, LinkTrimeshes& meshes,
                                           std::vector<LinkPair> pairs) {
  constexpr int kPostures = 256;
  std::mt19937_64 random(kSeed);
  Kinematics kinematics(robot);
  for (int posture = 0; posture < kPostures && !pairs.empty(); ++posture) {
    kinematics.UpdatePoses(posture == 0 ? robot.NeutralConfiguration() : SamplePosture(robot, random));
    meshes.Place(kinematics);
    std::erase_if(pairs, [&](const LinkPair& pair) { return !Overlap(meshes, pair); });
  }
  return pairs;
}

void SetDetail(const RobotModel& robot, LinkTrimeshes& meshes, LinkPieces& pieces, LinkPairRules& rules) {
  const size_t n = robot.links().size();
  rules.detail.assign(n * n, PairResolution::kHulls);
  const auto detail = [&](const LinkPair& pair) -> PairResolution& {
    return rules.detail[static_cast<size_t>(pair.first) * n + static_cast<size_t>(pair.second)];
  };
  const std::vector<LinkPair>& apart = rules.pairs[PairSelection::kReference];
  for (const LinkPair& pair : FindFalselyOverlapping(robot, meshes, apart, ApartBy::kTouch))
    detail(pair) = PairResolution::kPieces;
  std::vector<LinkPair> touching;  // in the reference posture
  std::ranges::copy_if(rules.checked(), std::back_inserter(touching),
                       [&](const LinkPair& pair) { return std::ranges::find(apart, pair) == apart.end(); });
  const std::vector<SortedPoses> poses = SamplePoses(robot, meshes, touching, ApartBy::kTouch);
  for (size_t i = 0; i < touching.size(); ++i) {
    const auto& [first, second] = touching[i];
    const bool coarse = MostlyOverlap(poses[i].apart, {pieces.Pieces(first), pieces.Pieces(second)}, ApartBy::kTouch);
    detail(touching[i]) = coarse ? PairResolution::kBodies : PairResolution::kPieces;
  }
  for (const LinkPair& pair : rules.checked()) {
    if (detail(pair) != PairResolution::kHulls) rules.decomposed.push_back(pair);
  }
}

}  // namespace

LinkPairRules ClassifyLinkPairs(const RobotModel& robot, LinkTrimeshes& meshes, LinkPieces& pieces,
                                Eigen::Ref<const Eigen::VectorXd> reference_x, PairSelection selection) {
  Kinematics kinematics(robot);
  kinematics.Update(reference_x);
  meshes.Place(kinematics);
  LinkPairRules rules;
  rules.selection = selection;
  std::vector<LinkPair>& apart = rules.pairs[PairSelection::kReference];
  std::vector<LinkPair>& all = rules.pairs[PairSelection::kAll];
  all = NonAdjacentPairs(robot, meshes);
  std::ranges::copy_if(all, std::back_inserter(apart), [&](const LinkPair& pair) { return !Touch(meshes, pair); });
  const std::vector<LinkPair> others = all;
  std::vector<LinkPair> joined;
  std::ranges::copy_if(all, std::back_inserter(joined), [&](const LinkPair& pair) { return Overlap(meshes, pair); });
  joined = FindInseparablePairs(robot, meshes, std::move(joined));
  std::erase_if(all, [&](const LinkPair& pair) { return std::ranges::find(joined, pair) != joined.end(); });
  const bool by_reference = selection == PairSelection::kReference;
  rules.status =
      StatusOf(robot, others, by_reference ? PairStatus::kIgnoredReferencePose : PairStatus::kIgnoredInseparable,
               rules.checked());
  SetDetail(robot, meshes, pieces, rules);
  return rules;
}

std::vector<LinkPair> ShapedPairs(const RobotModel& robot) {
  std::vector<LinkPair> pairs;
  for (int b = 0; b < static_cast<int>(robot.links().size()); ++b) {
    for (int a = 0; a < b; ++a) {
      const auto has_shape = [&](int link) { return !robot.links()[static_cast<size_t>(link)].collision.empty(); };
      if (has_shape(a) && has_shape(b)) pairs.emplace_back(a, b);
    }
  }
  return pairs;
}

namespace {

/// Level of detail of a pair whose hulls overlap falsely.
struct ChosenDetail {
  PairResolution detail = PairResolution::kPieces;
  double false_depth_m = 0.0;
};

/// Chooses pieces or, if they overlap in most postures in which the meshes are apart, the better of pieces and bodies
/// with their false depth.
ChosenDetail ChooseDetail(const LinkPair& pair, const SortedPoses& poses, LinkPieces& pieces) {
  constexpr double kPerfect = 1.0;
  const PairShapes whole{pieces.Pieces(pair.first), pieces.Pieces(pair.second)};
  if (!MostlyOverlap(poses.apart, whole, ApartBy::kTolerance)) return {};
  const FalseDepth of_pieces = FindFalseDepth(poses, whole, ApartBy::kTolerance);
  if (of_pieces.score < kPerfect) {  // bodies take long to compute
    const PairShapes bodies{pieces.Bodies(pair.first), pieces.Bodies(pair.second)};
    const FalseDepth of_bodies = FindFalseDepth(poses, bodies, ApartBy::kTolerance);
    if (of_bodies.score > of_pieces.score) return {PairResolution::kBodies, of_bodies.length_m};
  }
  return {PairResolution::kPieces, of_pieces.length_m};
}

/// Sets the detail of pairs that collide in some samples. The hulls of all other pairs were apart in all samples.
void SetDetailOfListed(const RobotModel& robot, LinkTrimeshes& meshes, LinkPieces& pieces, LinkPairRules& rules) {
  const size_t n = robot.links().size();
  rules.detail.assign(n * n, PairResolution::kHulls);
  rules.decomposed = FindFalselyOverlapping(robot, meshes, rules.pairs[PairSelection::kReference], ApartBy::kTolerance);
  std::set<int> links;
  for (const auto& [a, b] : rules.decomposed) links.insert({a, b});
  pieces.PreparePieces(links);
  const std::vector<SortedPoses> poses = SamplePoses(robot, meshes, rules.decomposed, ApartBy::kTolerance);
  for (size_t i = 0; i < rules.decomposed.size(); ++i) {
    const LinkPair& pair = rules.decomposed[i];
    const ChosenDetail chosen = ChooseDetail(pair, poses[i], pieces);
    rules.detail[static_cast<size_t>(pair.first) * n + static_cast<size_t>(pair.second)] = chosen.detail;
    rules.false_depths_m.push_back(chosen.false_depth_m);
  }
}

}  // namespace

double LinkPairRules::FalseDepth_m(const LinkPair& pair) const {
  if (false_depths_m.empty()) return 0.0;
  const auto at = std::ranges::lower_bound(decomposed, std::pair(pair.second, pair.first), std::less<>(),
                                           [](const LinkPair& other) { return std::pair(other.second, other.first); });
  if (at == decomposed.end() || *at != pair) return 0.0;
  return false_depths_m[static_cast<size_t>(at - decomposed.begin())];
}

LinkPairRules ClassifyListedPairs(const RobotModel& robot, LinkTrimeshes& meshes, LinkPieces& pieces,
                                  const std::vector<UncheckedPair>& unchecked) {
  std::map<LinkPair, UncheckedReason> reasons;
  for (const UncheckedPair& entry : unchecked) reasons.emplace(entry.pair, entry.reason);
  LinkPairRules rules;
  rules.status = NoneChecked(robot);
  for (const LinkPair& pair : ShapedPairs(robot)) {
    const auto found = reasons.find(pair);
    const bool listed = found != reasons.end();
    if (!listed || found->second == UncheckedReason::kNever) rules.pairs[PairSelection::kAll].push_back(pair);
    if (listed) continue;
    rules.pairs[PairSelection::kReference].push_back(pair);
    SetStatus(robot, pair, PairStatus::kChecked, &rules.status);
  }
  SetDetailOfListed(robot, meshes, pieces, rules);
  return rules;
}

void SelectListedPairs(const RobotModel& robot, const std::vector<UncheckedPair>& unchecked, PairSelection selection,
                       LinkPairRules* rules) {
  rules->selection = selection;
  const auto has_shape = [&](int link) { return !robot.links()[static_cast<size_t>(link)].collision.empty(); };
  for (const UncheckedPair& entry : unchecked) {
    if (!has_shape(entry.pair.first) || !has_shape(entry.pair.second)) continue;
    SetStatus(robot, entry.pair, StatusOfListed(entry.reason, selection), &rules->status);
  }
}

}  // namespace legopt

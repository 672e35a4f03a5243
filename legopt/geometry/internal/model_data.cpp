#include "legopt/geometry/internal/model_data.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <map>
#include <numbers>
#include <random>
#include <set>
#include <utility>

#include "legopt/geometry/internal/placed_shapes.h"
#include "legopt/robot/kinematics.h"

namespace legopt {
namespace {

using PairStatus = CollisionModel::PairStatus;

constexpr double kNoticeable = 1e-3;  // m; the judge's tolerance
constexpr std::uint64_t kSeed = 1;

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

bool Touch(const LinkTrimeshes& meshes, const LinkPair& pair) {
  return AnyGeometries(meshes, pair, [&](const auto& a, const auto& b) { return meshes.Depth(a, b) >= 0.0; });
}

/// Returns true if the hulls overlap by more than the tolerance, but the meshes do not touch.
bool IsFalseOverlap(const LinkTrimeshes& meshes, const LinkPair& pair) {
  const bool overlap =
      AnyGeometries(meshes, pair, [&](const auto& a, const auto& b) { return meshes.HullsOverlap(a, b, kNoticeable); });
  return overlap && !Touch(meshes, pair);
}

}  // namespace

bool Overlap(const LinkTrimeshes& meshes, const LinkPair& pair) {
  return AnyGeometries(meshes, pair, [&](const auto& a, const auto& b) { return meshes.Overlap(a, b, kNoticeable); });
}

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

std::vector<LinkPair> FindPhantomPairs(const RobotModel& robot, LinkTrimeshes& meshes,
                                       const std::vector<LinkPair>& checked) {
  constexpr int kPostures = 64;
  constexpr int kFairShare = 8;
  std::mt19937_64 random(kSeed);
  Kinematics kinematics(robot);
  std::vector<int> count(checked.size(), 0);
  for (int posture = 0; posture < kPostures; ++posture) {
    kinematics.UpdatePoses(SamplePosture(robot, random));
    meshes.Place(kinematics);
    for (size_t i = 0; i < checked.size(); ++i) {
      if (count[i] < kFairShare && IsFalseOverlap(meshes, checked[i])) ++count[i];
    }
  }
  std::vector<LinkPair> phantom;
  for (size_t i = 0; i < checked.size(); ++i) {
    if (count[i] >= kFairShare) phantom.push_back(checked[i]);
  }
  return phantom;
}

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

/// Returns the table of LinkPairRules::status: `pairs` that are not in `checked` have the status `ignored`, all others
/// are adjacent.
std::vector<PairStatus> StatusOf(const RobotModel& robot, const std::vector<LinkPair>& pairs, PairStatus ignored,
                                 const std::vector<LinkPair>& checked) {
  const size_t n = robot.links().size();
  std::vector<PairStatus> status(n * n, PairStatus::kIgnoredAdjacent);
  const auto set = [&](const std::vector<LinkPair>& some, PairStatus value) {
    for (const auto& [a, b] : some) {
      const auto first = static_cast<size_t>(a), second = static_cast<size_t>(b);
      status[first * n + second] = status[second * n + first] = value;
    }
  };
  set(pairs, ignored);
  set(checked, PairStatus::kChecked);
  return status;
}

/// `reason`: null for a pair that is not listed.
PairStatus StatusOfListed(const UncheckedReason* reason, PairSelection selection) {
  if (reason == nullptr) return PairStatus::kChecked;
  switch (*reason) {
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

/// Returns true if the pieces of two links overlap in most postures in which the meshes do not. Few postures separate
/// some of these pairs, so many are sampled.
bool PiecesMostlyOverlap(const RobotModel& robot, LinkTrimeshes& meshes, LinkPieces& pieces, const LinkPair& pair) {
  constexpr int kPostures = 512;
  PlacedShapes first(pieces.Pieces(pair.first)), second(pieces.Pieces(pair.second));
  std::mt19937_64 random(kSeed);
  Kinematics kinematics(robot);
  int excess = 0;  // number of postures with overlapping pieces, minus the number without
  for (int posture = 0; posture < kPostures; ++posture) {
    const int rest = kPostures - posture;
    if (excess > rest || excess + rest <= 0) break;
    kinematics.UpdatePoses(posture == 0 ? robot.NeutralConfiguration() : SamplePosture(robot, random));
    for (const int link : {pair.first, pair.second}) meshes.Place(kinematics, link);
    if (Touch(meshes, pair) || Overlap(meshes, pair)) continue;
    first.Place(kinematics.link_pose(pair.first));
    second.Place(kinematics.link_pose(pair.second));
    excess += first.Overlap(second, kNoticeable) ? 1 : -1;
  }
  return excess > 0;
}

void SetDetail(const RobotModel& robot, LinkTrimeshes& meshes, LinkPieces& pieces, LinkPairRules& rules) {
  const size_t n = robot.links().size();
  rules.detail.assign(n * n, PairResolution::kHulls);
  const auto detail = [&](const LinkPair& pair) -> PairResolution& {
    return rules.detail[static_cast<size_t>(pair.first) * n + static_cast<size_t>(pair.second)];
  };
  const std::vector<LinkPair>& apart = rules.pairs[PairSelection::kReference];
  for (const LinkPair& pair : FindPhantomPairs(robot, meshes, apart)) detail(pair) = PairResolution::kPieces;
  for (const LinkPair& pair : rules.checked()) {
    if (std::ranges::find(apart, pair) != apart.end()) continue;
    detail(pair) = PiecesMostlyOverlap(robot, meshes, pieces, pair) ? PairResolution::kBodies : PairResolution::kPieces;
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

/// Sets the detail of pairs that collide in some samples: pairs whose hulls overlap falsely get pieces, or bodies if
/// the pieces do so in most postures. The hulls of all other pairs were apart in all samples.
void SetDetailOfListed(const RobotModel& robot, LinkTrimeshes& meshes, LinkPieces& pieces, LinkPairRules& rules) {
  const size_t n = robot.links().size();
  rules.detail.assign(n * n, PairResolution::kHulls);
  const std::vector<LinkPair> phantoms = FindPhantomPairs(robot, meshes, rules.pairs[PairSelection::kReference]);
  std::set<int> links;
  for (const auto& [a, b] : phantoms) links.insert({a, b});
  pieces.PreparePieces(links);
  for (const LinkPair& pair : phantoms) {
    rules.detail[static_cast<size_t>(pair.first) * n + static_cast<size_t>(pair.second)] =
        PiecesMostlyOverlap(robot, meshes, pieces, pair) ? PairResolution::kBodies : PairResolution::kPieces;
    rules.decomposed.push_back(pair);
  }
}

}  // namespace

LinkPairRules ClassifyListedPairs(const RobotModel& robot, LinkTrimeshes& meshes, LinkPieces& pieces,
                                  const std::vector<UncheckedPair>& unchecked, PairSelection selection) {
  std::map<LinkPair, UncheckedReason> reasons;
  for (const UncheckedPair& entry : unchecked) reasons.emplace(entry.pair, entry.reason);
  LinkPairRules rules;
  rules.selection = selection;
  const size_t n = robot.links().size();
  rules.status.assign(n * n, PairStatus::kIgnoredAdjacent);
  for (const LinkPair& pair : ShapedPairs(robot)) {
    const auto found = reasons.find(pair);
    const bool listed = found != reasons.end();
    if (!listed) rules.pairs[PairSelection::kReference].push_back(pair);
    if (!listed || found->second == UncheckedReason::kNever) rules.pairs[PairSelection::kAll].push_back(pair);
    const auto [a, b] = std::pair(static_cast<size_t>(pair.first), static_cast<size_t>(pair.second));
    rules.status[a * n + b] = rules.status[b * n + a] = StatusOfListed(listed ? &found->second : nullptr, selection);
  }
  SetDetailOfListed(robot, meshes, pieces, rules);
  return rules;
}

}  // namespace legopt

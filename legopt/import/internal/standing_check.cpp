#include "legopt/import/internal/standing_check.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "legopt/geometry/internal/pair_sampling.h"
#include "legopt/import/internal/nominal_posture.h"
#include "legopt/import/internal/standing_stage.h"
#include "legopt/robot/kinematics.h"
#include "legopt/types/check.h"
#include "legopt/types/number_text.h"

namespace legopt {
namespace {

using Severity = DatasetDiagnostic::Severity;

/// Returns the pairs with at most three moving joints between them that are compared and overlap at `x`.
std::vector<LinkPair> NearOverlaps(const Dataset& stage, const Eigen::VectorXd& x) {
  constexpr int kMostJoints = 3;
  if (!stage.unchecked_pairs()) return {};
  std::set<LinkPair> skipped;
  for (const UncheckedPair& entry : *stage.unchecked_pairs()) {
    if (entry.reason != UncheckedReason::kNever) skipped.insert(entry.pair);
  }
  const std::vector<Link>& links = stage.robot().links();
  std::vector<UncheckedPair> near;
  for (int second = 1; second < std::ssize(links); ++second) {
    for (int first = 0; first < second; ++first) {
      const bool bare = links[static_cast<std::size_t>(first)].collision.empty() ||
                        links[static_cast<std::size_t>(second)].collision.empty();
      if (bare || skipped.contains({first, second})) continue;
      if (stage.robot().MovingJointsBetween(first, second) <= kMostJoints) near.push_back({.pair = {first, second}});
    }
  }
  std::vector<LinkPair> overlaps;
  for (const PairDepth& found : DeepestPairs(stage.robot(), near, x, std::numeric_limits<int>::max())) {
    if (found.depth_m > kDepthTolerance_m) overlaps.push_back(found.pair);
  }
  return overlaps;
}

}  // namespace

StandingCheck::StandingCheck(const StandingOptions& options, std::filesystem::path folder, ReadGuard guard,
                             DatasetDescription* description, std::vector<DatasetDiagnostic>* findings)
    : options_(options),
      folder_(std::move(folder)),
      guard_(std::move(guard)),
      description_(*description),
      findings_(*findings) {}

std::optional<StandingRobot> StandingCheck::Run(const RobotModel& robot, const Eigen::VectorXd& guess) {
  constexpr int kMostRounds = 5;
  if (!options_.search_posture && !options_.prove) return std::nullopt;
  std::vector<LinkPair> excluded;
  for (int round = 0;; ++round) {
    const StandingStage stage(description_, folder_, guard_);
    std::optional<Eigen::VectorXd> found;
    Eigen::VectorXd nominal = robot.NeutralConfiguration();
    nominal.head(robot.num_dofs()) = stage.dataset()->nominal_joints();
    nominal[robot.base_position_index() + 2] = -stage.dataset()->nominal_sole_height_m();
    if (options_.search_posture) {
      found = FindNominalPosture(stage.dataset(), guess);
      if (found) nominal = *found;
    }
    std::optional<StandingRobot> result;
    if (options_.prove) {
      result = StandingRobot{.proof = ProveStanding(stage.dataset(), nominal, false), .view = {}};
      const std::vector<LinkPair> pairs = result->proof.stands || !description_.self_collision || round == kMostRounds
                                              ? std::vector<LinkPair>()
                                              : NearOverlaps(*stage.dataset(), result->proof.x);
      if (!pairs.empty()) {
        Exclude(pairs, robot);
        excluded.insert(excluded.end(), pairs.begin(), pairs.end());
        continue;
      }
    }
    if (options_.search_posture) NoteNominal(robot, found);
    if (!result) return result;
    NotePairs(excluded, robot);
    NoteProof(result->proof, false);
    NoteProof(ProveStanding(stage.dataset(), nominal, true), true);
    result->view = ViewOf(*stage.dataset(), result->proof.x);
    return result;
  }
}

/// Lists pairs as not compared; a pair is in the list once.
void StandingCheck::Exclude(const std::vector<LinkPair>& pairs, const RobotModel& robot) {
  for (const LinkPair& pair : pairs) {
    const std::string& first = robot.links()[static_cast<std::size_t>(pair.first)].name;
    const std::string& second = robot.links()[static_cast<std::size_t>(pair.second)].name;
    std::erase_if(description_.self_collision->unchecked,
                  [&](const auto& entry) { return entry.first == first && entry.second == second; });
    description_.self_collision->unchecked.push_back({first, second, UncheckedReason::kStanding});
  }
}

void StandingCheck::NotePairs(const std::vector<LinkPair>& pairs, const RobotModel& robot) {
  if (pairs.empty()) return;
  std::string names;
  for (const LinkPair& pair : pairs) {
    names += (names.empty() ? "" : ", ") + robot.links()[static_cast<std::size_t>(pair.first)].name + " - " +
             robot.links()[static_cast<std::size_t>(pair.second)].name;
  }
  Note(Severity::kWarning, "link pairs", names, std::to_string(pairs.size()) + (pairs.size() == 1 ? " pair" : " pairs"),
       "overlap wherever the robot was found to stand, and are not compared",
       "shrink their meshes, or accept that no collision of these links is found");
}

void StandingCheck::NoteNominal(const RobotModel& robot, const std::optional<Eigen::VectorXd>& nominal) {
  constexpr double kPerRadian = 1e4;
  const std::vector<std::string> names = DofNames(robot);
  int moved = 0;
  for (std::size_t dof = 0; nominal && dof < names.size(); ++dof) {
    const double value = std::round((*nominal)[static_cast<Eigen::Index>(dof)] * kPerRadian) / kPerRadian;
    if (value == 0.0) continue;
    description_.nominal_posture[names[dof]] = value;
    ++moved;
  }
  if (moved == 0) {
    Note(Severity::kWarning, "nominal posture", kDatasetFileName, "all joints 0",
         "none was found with bent legs; solves start from straight ones, which is a bad start",
         "bend the knees: --nominal JOINT=RADIANS for each joint, or edit nominal_posture and run 'legopt dataset "
         "hash'");
    return;
  }
  Note(Severity::kInfo, "nominal posture", kDatasetFileName, std::to_string(moved) + " joints are not 0",
       "found: stands on level ground with bent legs; others: --nominal, or edit nominal_posture");
}

void StandingCheck::NoteProof(const StandingProof& proof, bool on_ramp) {
  constexpr double kMillimetres = 1e3;
  const std::string place = on_ramp ? "on a slope of 10 degrees" : "on level ground";
  if (proof.stands) {
    Note(Severity::kInfo, "standing", place, std::to_string(description_.contacts.size()) + " contacts",
         "the robot stands; its centre of mass is " + FormatFixed(kMillimetres * std::max(0.0, proof.com_margin_m), 0) +
             " mm inside the support polygon");
    return;
  }
  std::string conflict;
  for (const std::string& term : proof.conflict) conflict += (conflict.empty() ? "" : ", ") + term;
  Note(on_ramp ? Severity::kWarning : Severity::kError, "standing", place,
       conflict.empty() ? proof.detail : "in conflict: " + conflict,
       conflict.empty()
           ? "no posture that stands was found"
           : "no posture within the joint limits was found that satisfies these; of the nearest one: " + proof.detail,
       on_ramp ? "the robot can only be used on gentler slopes"
               : "correct contacts, limits or masses of the robot; --no-proof imports it as it is");
}

void StandingCheck::Note(Severity severity, const std::string& check, const std::string& field,
                         const std::string& value, const std::string& message, const std::string& fix) {
  findings_.push_back({severity, check, "", field, value, message, fix});
}

}  // namespace legopt

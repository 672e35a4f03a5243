#include "legopt/import/internal/self_collision_pairs.h"

#include <string>

#include "legopt/types/number_text.h"

namespace legopt {
namespace {

using Severity = DatasetDiagnostic::Severity;

std::string NamesOf(const RobotModel& robot, const LinkPair& pair) {
  return robot.links()[static_cast<size_t>(pair.first)].name + " - " +
         robot.links()[static_cast<size_t>(pair.second)].name;
}

Eigen::VectorXd Configuration(const RobotModel& robot, const std::map<std::string, double>& joints) {
  Eigen::VectorXd x = robot.NeutralConfiguration();
  for (const auto& [name, value] : joints) {
    const int joint = robot.FindJoint(name);
    if (joint < 0) continue;
    const Joint& found = robot.joints()[static_cast<size_t>(joint)];
    if (found.dof >= 0 && found.leader < 0) x[found.dof] = value;
  }
  robot.ClampJoints(x);
  return x;
}

DatasetDiagnostic NominalOnly(const RobotModel& robot, const std::vector<LinkPair>& pairs) {
  constexpr size_t kShown = 3;
  std::string names;
  for (size_t i = 0; i < std::min(pairs.size(), kShown); ++i) names += (i == 0 ? "" : ", ") + NamesOf(robot, pairs[i]);
  if (pairs.size() > kShown) names += " and " + std::to_string(pairs.size() - kShown) + " more";
  return {.severity = Severity::kWarning,
          .check = "link pairs",
          .file = "",
          .field = names,
          .value = std::to_string(pairs.size()) + (pairs.size() == 1 ? " pair" : " pairs"),
          .message = "may collide in the nominal posture, but in no sampled posture; compared all the same",
          .fix = "choose another nominal posture, or list the pair as 'user' in self_collision of dataset.yaml"};
}

}  // namespace

SampledDescription SampleSelfCollision(const RobotModel& robot, const std::map<std::string, double>& nominal_posture,
                                       const PairSamplingOptions& options) {
  const SampledPairs sampled = SampleLinkPairs(robot, Configuration(robot, nominal_posture), options);
  SampledDescription result;
  result.pairs.samples = options.samples;
  result.pairs.seed = static_cast<std::int64_t>(options.seed);
  for (const UncheckedPair& entry : sampled.unchecked) {
    const auto name = [&](int link) { return robot.links()[static_cast<size_t>(link)].name; };
    result.pairs.unchecked.push_back({name(entry.pair.first), name(entry.pair.second), entry.reason});
  }
  if (!sampled.nominal_only.empty()) result.findings.push_back(NominalOnly(robot, sampled.nominal_only));
  return result;
}

std::vector<DatasetDiagnostic> ExcludeSrdfPairs(const SrdfContent& srdf, const RobotModel& robot,
                                                DatasetDescription::SelfCollision* pairs) {
  const auto has_shape = [&](const std::string& link) {
    return !robot.links()[static_cast<size_t>(robot.FindLink(link))].collision.empty();
  };
  int excluded = 0, left = 0;
  for (const SrdfPair& pair : srdf.disabled) {
    if (!has_shape(pair.first) || !has_shape(pair.second)) continue;
    const auto same = [&](const auto& entry) { return entry.first == pair.first && entry.second == pair.second; };
    const auto known = std::ranges::find_if(pairs->unchecked, same);
    if (known != pairs->unchecked.end() && known->reason != UncheckedReason::kNever) continue;
    if (pair.reason == "adjacent" || pair.reason == "never") {
      left += known == pairs->unchecked.end() ? 1 : 0;
      continue;
    }
    if (known != pairs->unchecked.end()) pairs->unchecked.erase(known);
    pairs->unchecked.push_back({pair.first, pair.second, UncheckedReason::kUser});
    ++excluded;
  }
  if (excluded + left == 0) return {};
  const std::string kept = left == 0 ? ""
                                     : "; " + std::to_string(left) +
                                           " that it calls adjacent or never in collision collide in samples, "
                                           "and are compared";
  return {{.severity = Severity::kInfo,
           .check = "SRDF",
           .file = "",
           .field = srdf.file.filename().string(),
           .value = std::to_string(excluded) + (excluded == 1 ? " pair" : " pairs"),
           .message = "excluded by it, and not compared" + kept,
           .fix = ""}};
}

PairCounts CountPairs(const Dataset& dataset) {
  PairCounts counts;
  if (!dataset.unchecked_pairs()) return counts;
  for (const UncheckedPair& entry : *dataset.unchecked_pairs()) ++counts.unchecked[entry.reason];
  int shaped = 0;
  for (const Link& link : dataset.robot().links()) shaped += link.collision.empty() ? 0 : 1;
  counts.checked = shaped * (shaped - 1) / 2 - static_cast<int>(dataset.unchecked_pairs()->size());
  return counts;
}

std::string DescribeDeepestPairs(const Dataset& dataset, int count) {
  if (!dataset.unchecked_pairs()) return "none";
  constexpr double kMillimetres = 1e3;
  Eigen::VectorXd x = dataset.robot().NeutralConfiguration();
  x.head(dataset.robot().num_dofs()) = dataset.nominal_joints();
  std::string text;
  for (const PairDepth& found : DeepestPairs(dataset.robot(), *dataset.unchecked_pairs(), x, count)) {
    text += (text.empty() ? "" : ", ") + NamesOf(dataset.robot(), found.pair) + " " +
            FormatFixed(kMillimetres * found.depth_m, 1) + " mm (" + std::string(ToString(found.reason)) + ")";
  }
  return text.empty() ? "none" : text;
}

std::vector<DatasetDiagnostic> CheckUncheckedPairs(const Dataset& dataset) {
  if (!dataset.unchecked_pairs()) return {};
  constexpr int kShown = 3;
  const PairCounts counts = CountPairs(dataset);
  std::string unchecked;
  for (const EnumName<UncheckedReason>& row : kEnumNames<UncheckedReason>) {
    const int count = counts.unchecked[row.value];
    if (count > 0 || row.value != UncheckedReason::kUser) {
      unchecked += (unchecked.empty() ? "" : ", ") + std::to_string(count) + " " + std::string(row.word);
    }
  }
  return {{.severity = Severity::kInfo,
           .check = "link pairs",
           .file = "",
           .field = "",
           .value = std::to_string(counts.checked) + " compared",
           .message = "not compared: " + unchecked +
                      "; of these overlap most in the nominal posture: " + DescribeDeepestPairs(dataset, kShown),
           .fix = ""}};
}

}  // namespace legopt
